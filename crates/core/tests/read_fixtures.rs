//! Files written by other programs, point for point.

mod read_support;

use asbuilt_core::read::{open, open_coarse, open_known};
use e57::{CartesianCoordinate, E57Reader, E57Writer, Record, RecordDataType, RecordName, RecordValue};
use read_support::{data, expected, fixtures, read, read_part, scratch};

#[test]
fn every_fixture_gives_its_points() {
    let all = fixtures();
    assert!(all.len() > 80, "fixtures.csv lists {} files", all.len());
    for fixture in all {
        let cloud = read(&data().join(&fixture.name)).unwrap_or_else(|error| panic!("{error}"));
        let points = expected(&fixture.points);
        assert_eq!(cloud.points.len(), points.len(), "{}", fixture.name);
        for (i, ((found, scan), row)) in cloud.points.iter().zip(&points).enumerate() {
            // A tolerance that says 0 means the same decimal, which arithmetic on 5,412,345.678 keeps to 1 nm.
            let allowed = fixture.tolerance.max(1e-9);
            let off = (0..3).map(|axis| (found[axis] - row[axis]).abs()).fold(0.0, f64::max);
            assert!(off <= allowed, "{} point {i}: expected {row:?}, found {found:?}", fixture.name);
            if let Some(&expected) = row.get(3) {
                assert_eq!(f64::from(*scan), expected, "{} point {i}", fixture.name);
            }
        }
        let bounds = cloud.header.bounds.filter(|_| !points.is_empty());
        if let Some([low, high]) = bounds {
            let inside = |row: &Vec<f64>| {
                (0..3).all(|i| {
                    low[i] - fixture.tolerance - 1e-6 <= row[i] && row[i] <= high[i] + fixture.tolerance + 1e-6
                })
            };
            assert!(points.iter().all(inside), "{}: {bounds:?}", fixture.name);
        }
    }
}

#[test]
fn headers_say_what_the_file_is() {
    let format = |name: &str| open(&data().join(name)).unwrap().header().format.clone();
    assert_eq!(format("las12_format3.las"), "LAS 1.2, point format 3");
    assert_eq!(format("las14_format6.laz"), "LAS 1.4, point format 6, LAZ");
    assert_eq!(format("copc.laz"), "LAS 1.4, point format 7, COPC");
    assert_eq!(format("e57_double.e57"), "E57 1.0");
    assert_eq!(format("ply_odd_order_big.ply"), "PLY, binary big endian");
    assert_eq!(format("pcd_open3d_compressed.pcd"), "PCD, binary_compressed");
    assert_eq!(format("text_header_order.csv"), "CSV, columns 3, 4, 2 between ','");
    assert_eq!(format("text_decimal_comma.csv"), "CSV, columns 1, 2, 3 between ';', decimal commas");
    assert_eq!(format("text_one_block.pts"), "PTS, columns 1, 2, 3 between blanks");
}

#[test]
fn coordinate_systems_come_from_wkt_or_geotiff_keys() {
    let crs = |name: &str| open(&data().join(name)).unwrap().header().crs.clone();
    assert_eq!(crs("las_crs_geotiff.las").as_deref(), Some("EPSG:32632"));
    let wkt = "PROJCS[\"ETRS89 / UTM zone 32N\",AUTHORITY[\"EPSG\",\"25832\"]]";
    assert_eq!(crs("las_crs_wkt.laz").as_deref(), Some(wkt));
    assert_eq!(crs("las_crs_wkt_evlr.las").as_deref(), Some(wkt));
    assert_eq!(crs("copc.laz").as_deref(), Some("LOCAL_CS[\"site\"]"));
    assert_eq!(crs("e57_double.e57").as_deref(), Some("EPSG:25832"));
}

#[test]
fn scans_have_keys_names_and_positions() {
    for name in ["e57_double.e57", "e57_scaled.e57", "e57_spherical.e57"] {
        let header = open(&data().join(name)).unwrap().header().clone();
        assert_eq!(header.points, Some(150));
        let keys: Vec<_> = header.scans.iter().map(|scan| scan.key.clone()).collect();
        assert_eq!(keys, [0, 1, 2].map(|i| format!("{{{name} {i}}}")));
        assert_eq!(header.scans[1].name.as_deref(), Some("Setup 2"));
        assert_eq!(header.scans[1].position, Some([500_123.5, 5_412_345.25, 312.0]));
        assert_eq!(header.scans[2].position, Some([-3.0, 2.0, 1.5]));
        assert_eq!(header.scans[2].points, Some(50));
    }
    // An identity pose tells where a spherical scan stood; Cartesian points may be in any frame.
    let position = |name: &str| open(&data().join(name)).unwrap().header().scans[0].position;
    assert_eq!(position("e57_spherical.e57"), Some([0.0; 3]));
    assert_eq!(position("e57_double.e57"), None);
    let ptx = open(&data().join("text_two_scans.ptx")).unwrap().header().clone();
    assert_eq!(ptx.scans[0].position, Some([500_123.5, 5_412_345.25, 312.0]));
    assert_eq!(ptx.points, Some(120));
    assert_ne!(ptx.scans[0].key, ptx.scans[1].key);
}

#[test]
fn what_is_known_of_a_file_is_not_looked_for_again() {
    let path = data().join("text_two_scans.ptx");
    let first = open(&path).unwrap();
    let length = std::fs::metadata(&path).unwrap().len();
    assert!(matches!(first.scan_ends().as_slice(), &[one, last] if one < last && last == length));
    // Ends that cannot be those of its scans are not believed.
    for ends in [first.scan_ends(), Vec::new(), vec![0, 0], vec![length + 1, u64::MAX]] {
        let again = open_known(&path, None, &ends).unwrap();
        assert_eq!((again.header(), again.parts()), (first.header(), first.parts()));
        for part in 0..again.parts() {
            assert_eq!(read_part(again.as_ref(), part).unwrap(), read_part(first.as_ref(), part).unwrap());
        }
    }
}

#[test]
fn a_scan_keeps_its_key_under_another_name() {
    for name in ["text_one_block.pts", "las12_format3.las", "text_two_scans.ptx", "ply_meshio_binary.ply"] {
        let path = data().join(name);
        let copy = scratch(&format!("renamed_{name}"));
        std::fs::copy(&path, &copy).unwrap();
        let (one, other) = (open(&path).unwrap(), open(&copy).unwrap());
        assert_eq!(one.header().scan_key(0), other.header().scan_key(0));
        assert_eq!(one.header().scan_key(7), other.header().scan_key(7));
    }
    let key = |name: &str| open(&data().join(name)).unwrap().header().scan_key(0);
    assert_ne!(key("text_one_block.pts"), key("text_two_blocks.pts"));
}

#[test]
fn what_is_left_out_is_counted() {
    let skipped = |name: &str| read(&data().join(name)).unwrap().skipped;
    assert_eq!(skipped("e57_invalid_states.e57").invalid, 50);
    assert_eq!(skipped("e57_invalid_states_spherical.e57").invalid, 50);
    assert_eq!(skipped("text_two_scans.ptx").invalid, 20);
    assert_eq!(skipped("text_not_finite.xyz").not_finite, 8);
}

#[test]
fn empty_clouds_are_read_as_such() {
    for name in ["las_no_points.las", "las_no_points.laz", "e57_no_scans.e57"] {
        let cloud = read(&data().join(name)).unwrap();
        assert_eq!((cloud.header.points, cloud.points.len()), (Some(0), 0), "{name}");
    }
}

#[test]
fn chunks_of_laz_are_parts() {
    for name in ["laz_three_chunks_format0.laz", "laz_three_chunks_format6.laz"] {
        let source = open(&data().join(name)).unwrap();
        // Chunks of 50,000 points, two or three to a part.
        let counts: Vec<_> = (0..source.parts()).map(|part| read_part(&*source, part).unwrap().0.len()).collect();
        assert_eq!(counts.iter().sum::<usize>(), 100_050);
    }
}

#[test]
fn a_preview_of_copc_is_its_upper_levels() {
    // A root of 80 points, 1 m apart by its own account, and two nodes below it.
    let (path, all) = (data().join("copc.laz"), expected("copc"));
    for (spacing, count) in [(Some(3.0), 80), (Some(1.0), 80), (Some(0.99), 240), (Some(0.01), 240), (None, 240)] {
        let source = open_coarse(&path, spacing).unwrap();
        let points: Vec<_> = (0..source.parts()).flat_map(|part| read_part(source.as_ref(), part).unwrap().0).collect();
        assert_eq!((points.len(), source.header().points), (count, Some(count as u64)), "{spacing:?}");
        for ((found, scan), row) in points.iter().zip(&all) {
            assert!((0..3).all(|axis| (found[axis] - row[axis]).abs() < 1e-9) && f64::from(*scan) == row[3]);
        }
        let is_said = source.header().notes.iter().any(|note| note == "preview: 80 of 240 points, evenly spread");
        assert_eq!(is_said, count == 80);
    }
    // Other formats have no levels.
    assert_eq!(open_coarse(&data().join("las14_format7.laz"), Some(1.0)).unwrap().header().points, Some(150));
}

#[test]
fn laz_without_chunk_table_is_read_from_its_start() {
    for name in
        ["las12_format3.laz", "las14_format7.laz", "laz_three_chunks_format0.laz", "laz_three_chunks_format6.laz"]
    {
        let mut bytes = std::fs::read(data().join(name)).unwrap();
        let start = u32::from_le_bytes(bytes[96..100].try_into().unwrap()) as usize;
        let table = u64::from_le_bytes(bytes[start..start + 8].try_into().unwrap()) as usize;
        bytes.truncate(table);
        bytes[start..start + 8].copy_from_slice(&(-1i64).to_le_bytes());
        let path = read_support::write(&format!("no_table_{name}"), &bytes);
        let (found, expected) = (read(&path).unwrap(), read(&data().join(name)).unwrap());
        assert!(found.points == expected.points, "{name}");
    }
}

/// What the `e57` crate makes of the same file, scan after scan, invalid ones left out.
fn read_by_e57_crate(path: &std::path::Path) -> Vec<([f64; 3], u32)> {
    let mut reader = E57Reader::from_file(path).unwrap();
    let mut points = Vec::new();
    for (scan, cloud) in (0..).zip(reader.pointclouds()) {
        for point in reader.pointcloud_simple(&cloud).unwrap() {
            if let CartesianCoordinate::Valid { x, y, z } = point.unwrap().cartesian {
                points.push(([x, y, z], scan));
            }
        }
    }
    points
}

#[test]
fn e57_agrees_with_the_e57_crate_bit_for_bit() {
    for fixture in fixtures().into_iter().filter(|fixture| fixture.name.ends_with(".e57")) {
        let path = data().join(&fixture.name);
        assert!(read(&path).unwrap().points == read_by_e57_crate(&path), "{}", fixture.name);
    }
}

#[test]
fn large_e57_scans_can_be_entered_anywhere() {
    // Written by the crate's own writer, with values of 64, 32, 21 and 63 bits: packets end within values.
    let double = RecordDataType::Double { min: None, max: None };
    let single = RecordDataType::Single { min: None, max: None };
    let narrow = RecordDataType::ScaledInteger { min: -1_000_000, max: 1_000_000, scale: 0.001, offset: 0.5 };
    let wide = RecordDataType::ScaledInteger { min: -(1 << 61), max: 1 << 61, scale: 1e-12, offset: 0.0 };
    for (kind, types) in [
        ("double", [double.clone(), double.clone(), double.clone()]),
        ("single", [single.clone(), single.clone(), single.clone()]),
        ("narrow", [narrow.clone(), narrow.clone(), narrow.clone()]),
        ("mixed", [wide, narrow, single]),
    ] {
        let path = scratch(&format!("large_{kind}.e57"));
        let mut writer = E57Writer::from_file(&path, "{file}").unwrap();
        let names = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ];
        let mut prototype = vec![Record::INTENSITY_UNIT_F32];
        prototype.extend(names.into_iter().zip(types.clone()).map(|(name, data_type)| Record { name, data_type }));
        let mut points = writer.add_pointcloud("{scan}", prototype).unwrap();
        let n = 600_000i64;
        for i in 0..n {
            let raw = |k: i64| (i * k) % 1_999_999 - 999_999;
            let value = |axis: usize| match types[axis] {
                RecordDataType::Double { .. } => RecordValue::Double(raw(7919) as f64 * 0.001),
                RecordDataType::Single { .. } => RecordValue::Single(raw(104_729) as f32 * 0.001),
                _ if kind == "mixed" && axis == 0 => RecordValue::ScaledInteger(raw(15_485_863) << 40),
                _ => RecordValue::ScaledInteger(raw(1_299_709 + axis as i64)),
            };
            points.add_point(vec![RecordValue::Single(0.5), value(0), value(1), value(2)]).unwrap();
        }
        points.finalize().unwrap();
        writer.finalize().unwrap();
        let source = open(&path).unwrap();
        assert!(source.parts() >= 3, "one scan is split among threads");
        assert!(read(&path).unwrap().points == read_by_e57_crate(&path), "{kind}");
        std::fs::remove_file(path).unwrap();
    }
}
