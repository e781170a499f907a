//! Evidence files: the same evidence is the same bytes, and whatever bytes come in, they do no harm.

mod read_support;

use std::path::Path;

use asbuilt_core::Error;
use asbuilt_core::store::{from_bytes, load, save, summary, to_bytes};
use asbuilt_core::voxel::{Evidence, Kept};
use read_support::{Numbers, rounds, scratch, write};

/// Points of three scans about the origin and a stray far away.
fn evidence(kept: Kept, order: [usize; 3]) -> Evidence {
    let mut evidence = Evidence::new(0.05, kept).unwrap();
    for number in order {
        let mut numbers = Numbers(number as u64 + 1);
        let points: Vec<_> =
            (0..500).map(|_| [0, 1, 2].map(|axis| numbers.uniform() * [3.0, 2.0, 0.1][axis] - 1.0)).collect();
        let scan = evidence.scan(&format!("scan {number}"), (number == 1).then_some([1.5, -2.5, 0.0]));
        evidence.add(&points, scan);
        evidence.add(&[[number as f64 * 1e6, -9e7, 0.0]], scan);
    }
    evidence
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
