//! Evidence files: the same evidence is the same bytes, and whatever bytes come in, they do no harm.

mod read_support;

use std::collections::BTreeMap;
use std::path::Path;

use asbuilt_core::store::{Stored, save, summary, to_bytes};
use asbuilt_core::voxel::{Evidence, Kept, Moments, SIDE};
use asbuilt_core::{Error, Result};
use read_support::{Numbers, rounds, scratch, write};

/// Points of a scan about the origin, and a stray far away.
fn points(number: usize) -> Vec<[f64; 3]> {
    let mut numbers = Numbers(number as u64 + 1);
    let near = (0..500).map(|_| [0, 1, 2].map(|axis| numbers.uniform() * [3.0, 2.0, 0.1][axis] - 1.0));
    near.chain([[number as f64 * 1e6, -9e7, 0.0]]).collect()
}

fn evidence(kept: Kept, order: [usize; 3]) -> Evidence {
    let mut evidence = Evidence::new(0.05, kept).unwrap();
    for number in order {
        let scan = evidence.scan(&format!("scan {number}"), (number == 1).then_some([1.5, -2.5, 0.0]));
        evidence.add(&points(number), scan);
    }
    evidence
}

fn load(path: &Path) -> Result<(Evidence, String)> {
    let stored = Stored::open(path)?;
    Ok((stored.evidence()?, stored.summary.about))
}

fn from_bytes(bytes: &[u8], name: &Path) -> Result<(Evidence, String)> {
    let stored = Stored::of(bytes.to_vec(), name)?;
    Ok((stored.evidence()?, stored.summary.about))
}

fn both() -> [Evidence; 2] {
    [evidence(Kept::Moments, [0, 1, 2]), evidence(Kept::Occupancy, [0, 1, 2])]
}

#[test]
fn what_is_written_is_read_back() {
    for evidence in both() {
        let path = scratch(&format!("round_trip_{:?}.evidence", evidence.kept()));
        save(&evidence, "where it comes from: Wände", &path).unwrap();
        let (found, about) = load(&path).unwrap();
        assert_eq!(about, "where it comes from: Wände");
        assert_eq!(found.voxels(), evidence.voxels());
        assert_eq!(found.scans(), evidence.scans());
        assert_eq!(found.brick_scans(), evidence.brick_scans());
        assert_eq!((found.points(), found.voxel(), found.kept()), (1503, 0.05, evidence.kept()));
        let said = summary(&path).unwrap();
        assert_eq!((said.points, &said.scans, &said.about), (1503, &evidence.scans(), &about));
        assert_eq!(to_bytes(&found, &about), std::fs::read(&path).unwrap());
    }
}

#[test]
fn a_file_hands_on_the_voxels_of_its_points_in_order() {
    // Of each voxel, by whole tenths of a millimetre.
    let mut expected = BTreeMap::<[i32; 3], Moments>::new();
    for point in (0..3).flat_map(points) {
        let quanta = point.map(|value| (value * 1e4).round_ties_even() as i64);
        let [x, y, z] = quanta.map(|quantum| quantum.rem_euclid(500) as u64);
        let moments = expected.entry(quanta.map(|quantum| quantum.div_euclid(500) as i32)).or_default();
        moments.count += 1;
        moments.sum = [moments.sum[0] + x, moments.sum[1] + y, moments.sum[2] + z];
        let [xx, xy, yy] = moments.products;
        moments.products = [xx + x * x, xy + x * y, yy + y * y];
    }
    let mut bricks: Vec<_> = expected.keys().map(|voxel| voxel.map(|index| index.div_euclid(SIDE))).collect();
    bricks.sort_unstable();
    bricks.dedup();
    for evidence in both() {
        let stored = Stored::of(to_bytes(&evidence, ""), Path::new("x")).unwrap();
        let mut found = Vec::new();
        stored.each_voxel(|voxel| found.push((voxel.index, voxel.moments))).unwrap();
        let nothing = evidence.kept() == Kept::Occupancy;
        let of =
            |(&index, &moments): (&[i32; 3], &Moments)| (index, if nothing { Moments::default() } else { moments });
        assert_eq!(found, expected.iter().map(of).collect::<Vec<_>>());
        // Of a brick there are at most eight numbers besides: its step, its scans, and how many it has of them and of voxels.
        let besides = 1 + bricks.len() * if nothing { 8 } else { 1 };
        assert!((found.len()..=found.len() + besides).contains(&stored.most_voxels()), "{}", stored.most_voxels());
    }
}

#[test]
fn sums_are_right_beyond_32_bits() {
    // Nine voxels of a brick, so that it is more than a few; in one of them many points, at its far corner.
    for (voxel, count) in [(0.05, 40_000), (5.0, 300)] {
        let last = (voxel * 1e4_f64).round() as u64 - 1;
        let others = (0..8).map(|i| [1.5 * voxel, 1.5 * voxel, (f64::from(i) + 0.5) * voxel]);
        let corner = [1.0, 1.0, 8.0].map(|index| index * voxel - 1e-4);
        let points: Vec<_> = others.chain(vec![corner; count]).collect();
        let halves = [(); 2].map(|()| {
            let mut evidence = Evidence::new(voxel, Kept::Moments).unwrap();
            let scan = evidence.scan("a", None);
            assert_eq!(evidence.add(&points, scan), 0);
            evidence
        });
        let [mut whole, other] = halves;
        whole.merge(other).unwrap();
        let (read, _) = from_bytes(&to_bytes(&whole, ""), Path::new("x")).unwrap();
        for evidence in [whole, read] {
            let n = 2 * count as u64;
            let found = evidence.voxels().into_iter().find(|voxel| voxel.index == [0, 0, 7]).unwrap().moments;
            assert_eq!(found, Moments { count: n, sum: [n * last; 3], products: [n * last * last; 3] });
        }
    }
}

#[test]
fn the_order_of_points_leaves_no_trace() {
    for kept in [Kept::Moments, Kept::Occupancy] {
        let bytes = to_bytes(&evidence(kept, [0, 1, 2]), "");
        for order in [[2, 1, 0], [1, 0, 2], [2, 0, 1]] {
            assert!(to_bytes(&evidence(kept, order), "") == bytes);
        }
    }
}

#[test]
fn occupancy_has_the_same_voxels() {
    let [moments, occupancy] = both();
    let indices = |evidence: &Evidence| evidence.voxels().iter().map(|voxel| voxel.index).collect::<Vec<_>>();
    assert_eq!(indices(&moments), indices(&occupancy));
    assert_eq!(moments.brick_scans(), occupancy.brick_scans());
    assert!(moments.clone().merge(occupancy).is_err());
}

#[test]
fn empty_evidence_is_a_file_too() {
    let empty = Evidence::new(0.1, Kept::Moments).unwrap();
    let (found, about) = from_bytes(&to_bytes(&empty, ""), Path::new("empty")).unwrap();
    assert_eq!((found.points(), found.len(), about.as_str()), (0, 0, ""));
}

#[test]
fn every_flipped_bit_and_every_cut_is_noticed() {
    for evidence in both() {
        let bytes = to_bytes(&evidence, "about");
        for place in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[place] ^= 1 << (place % 8);
            assert!(from_bytes(&damaged, Path::new("x")).is_err(), "bit {} of byte {place}", place % 8);
            if place % 7 == 0 {
                assert!(from_bytes(&bytes[..place], Path::new("x")).is_err(), "cut at {place}");
            }
        }
        let longer = [bytes.as_slice(), &[0]].concat();
        assert!(from_bytes(&longer, Path::new("x")).is_err());
    }
}

/// The same bytes with a right checksum, so that damage gets past it.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let end = bytes.len() - 4;
    let checksum = crc32c::crc32c(&bytes[..end]).to_le_bytes();
    bytes[end..].copy_from_slice(&checksum);
    bytes
}

#[test]
fn hostile_files_are_evidence_or_refused() {
    let mut numbers = Numbers(7);
    for evidence in both() {
        let bytes = to_bytes(&evidence, "about");
        for round in 0..rounds(3_000) {
            let mut damaged = bytes.clone();
            for _ in 0..=numbers.next() % 3 {
                // Most in the first bytes, where counts and lengths are.
                let end = if round % 3 > 0 { 120 } else { damaged.len() };
                let place = 20 + numbers.next() as usize % (end - 20);
                damaged[place] = [0xff, 0x80, 0, numbers.next() as u8][numbers.next() as usize % 4];
            }
            if let Ok((found, about)) = from_bytes(&sealed(damaged.clone()), Path::new("x")) {
                // Whatever is read can be used, and there is one way to write it.
                assert!(found.voxels().len() == found.len());
                let again = to_bytes(&found, &about);
                assert!(again == sealed(damaged), "round {round}");
                let mut merged = found.clone();
                let _ = merged.merge(found);
            }
        }
    }
}

#[test]
fn messages_are_one_line_and_say_what_to_do() {
    let says = |bytes: &[u8], expected: &str| {
        let path = write("said.evidence", bytes);
        let message = load(&path).unwrap_err().to_string();
        assert!(
            message.contains("said.evidence") && message.contains(expected) && !message.contains('\n'),
            "{message}"
        );
        assert!(summary(&path).is_err() || expected.contains("checksum"));
    };
    let [evidence, _] = both();
    let bytes = to_bytes(&evidence, "");
    let mut newer = bytes.clone();
    newer[16] = 2;
    says(&newer, "expected an evidence file of version 1, found 2; it needs a newer asbuilt");
    says(b"ply\n", "expected an evidence file (first bytes: asbuilt evidence), found other data");
    says(b"", "expected an evidence file");
    says(&bytes[..bytes.len() / 2], "checksum is wrong; the file is damaged or cut short");
    assert!(matches!(load(Path::new("/no/such/file.evidence")), Err(Error::Io { .. })));
    assert!(matches!(save(&evidence, "", Path::new("/no/such/folder/a.evidence")), Err(Error::Io { .. })));
}
