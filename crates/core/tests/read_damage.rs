//! Damaged and hostile files: every reader answers with points or with an error, soon, and within little memory.
#![allow(unsafe_code, reason = "an allocator that counts can only be written with it")]

mod read_support;

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::Instant;

use asbuilt_core::Error;
use asbuilt_core::read::{formats, open, open_coarse};
use proptest::collection::vec;
use proptest::prelude::{Strategy, any, prop_oneof};
use proptest::sample::{Index, select};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use read_support::{Numbers, data, fixtures, read, rounds, scratch, write};

/// Remembers how much was allocated at most.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: hands every call on to the system's allocator, unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        PEAK.fetch_max(NOW.fetch_add(layout.size(), Relaxed) + layout.size(), Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Tests that measure memory run one after the other.
static ALONE: Mutex<()> = Mutex::new(());

/// More than any reader needs for a file of a few kilobytes.
const BOUND: usize = 48 << 20;

/// Read a file, whatever comes of it, and complain if that took much memory or a message of more than a line.
fn survives(path: &Path) -> Result<usize, Error> {
    let before = NOW.load(Relaxed);
    PEAK.store(before, Relaxed);
    let start = Instant::now();
    let outcome = read(path).map(|cloud| cloud.points.len());
    // A hundredth of a second on a machine that has nothing else to do.
    assert!(start.elapsed().as_secs() < 20, "{}: {:?}", path.display(), start.elapsed());
    let used = PEAK.load(Relaxed) - before;
    assert!(used < BOUND, "{}: {used} bytes", path.display());
    if let Err(error) = &outcome {
        assert!(!error.to_string().contains('\n'), "{error}");
    }
    outcome
}

/// Fixtures that are read in no time, so that thousands of variants can be.
fn small_fixtures() -> impl Iterator<Item = read_support::Fixture> {
    fixtures().into_iter().filter(|fixture| !["grid", "packets"].contains(&fixture.points.as_str()))
}

fn alone() -> std::sync::MutexGuard<'static, ()> {
    // A decoder's panic is caught and is no news.
    std::panic::set_hook(Box::new(|info| {
        if info.location().is_some_and(|place| !place.file().contains("/laz-")) {
            eprintln!("{info}");
        }
    }));
    ALONE.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

#[test]
fn truncated_files_are_refused_or_give_what_is_left() {
    let _alone = alone();
    let mut numbers = Numbers(0xc07);
    for fixture in small_fixtures() {
        let bytes = std::fs::read(data().join(&fixture.name)).unwrap();
        let path = scratch(&format!("cut_{}", fixture.name));
        // Other places in each file: all together, every byte of the headers and many behind them.
        let step = (200 / rounds(10)).max(1);
        let cuts = (numbers.below(step)..bytes.len().min(500)).step_by(step);
        let cuts = cuts.chain((500..bytes.len()).step_by((bytes.len() / rounds(10)).max(1)));
        for cut in cuts {
            std::fs::write(&path, &bytes[..cut]).unwrap();
            let outcome = survives(&path);
            let is_text = fixture.name.starts_with("text_") && !fixture.name.ends_with("ptx");
            // Elements behind the points (faces), a trailing chunk table or XML may go missing with the points whole.
            if !is_text && cut < bytes.len() / 3 && !fixture.name.contains("no_") {
                assert!(outcome.is_err(), "{} cut at {cut} of {} was read", fixture.name, bytes.len());
            }
        }
        std::fs::remove_file(path).unwrap();
    }
}

#[test]
fn damaged_hierarchies_do_no_harm() {
    let _alone = alone();
    let mut numbers = Numbers(0xc0bc);
    let bytes = std::fs::read(data().join("copc.laz")).unwrap();
    let path = scratch("hierarchy.copc.laz");
    // The root's place stands in the first record; its entries behind the points.
    let root = u64::from_le_bytes(bytes[375 + 54 + 40..375 + 54 + 48].try_into().unwrap()) as usize;
    for round in 0..20 * rounds(10) {
        let mut damaged = bytes.clone();
        let place = if round % 3 > 0 { root + numbers.below(96) } else { 375 + 54 + 32 + numbers.below(24) };
        damaged[place] = [0xff, 0x80, 1, numbers.next() as u8][numbers.below(4)];
        std::fs::write(&path, &damaged).unwrap();
        for spacing in [1.0, 1e-9] {
            let before = NOW.load(Relaxed);
            PEAK.store(before, Relaxed);
            if let Ok(source) = open_coarse(&path, Some(spacing)) {
                let _ = (0..source.parts()).try_for_each(|part| source.read(part, &mut |_| Ok(())).map(drop));
            }
            assert!(PEAK.load(Relaxed) - before < BOUND);
        }
    }
    // A page that names itself.
    let mut circle = bytes.clone();
    circle[root + 28..root + 32].copy_from_slice(&(-1i32).to_le_bytes());
    circle[root + 16..root + 24].copy_from_slice(&(root as u64).to_le_bytes());
    circle[root + 24..root + 28].copy_from_slice(&96u32.to_le_bytes());
    std::fs::write(&path, &circle).unwrap();
    let message = open_coarse(&path, Some(0.1)).err().unwrap().to_string();
    assert!(message.contains("COPC hierarchy does not fit"), "{message}");
}

/// E57 pages with the checksums made right again, so that damage gets past them.
fn with_checksums(mut bytes: Vec<u8>) -> Vec<u8> {
    for page in bytes.chunks_exact_mut(1024) {
        let checksum = crc32c::crc32c(&page[..1020]).to_be_bytes();
        page[1020..].copy_from_slice(&checksum);
    }
    bytes
}

/// An E57 file with another XML section, which stands at its end.
fn with_xml(bytes: &[u8], edit: impl Fn(&str) -> String) -> Vec<u8> {
    let number = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
    let (place, length) = (number(24), number(32));
    let mut content: Vec<u8> = bytes.chunks_exact(1024).flat_map(|page| &page[..1020]).copied().collect();
    let start = place / 1024 * 1020 + place % 1024;
    let xml = edit(std::str::from_utf8(&content[start..start + length]).unwrap());
    content.truncate(start);
    content.extend(xml.as_bytes());
    content.resize(content.len().next_multiple_of(1020), 0);
    let file_length = content.len() as u64 / 1020 * 1024;
    content[16..24].copy_from_slice(&file_length.to_le_bytes());
    content[32..40].copy_from_slice(&(xml.len() as u64).to_le_bytes());
    with_checksums(content.chunks_exact(1020).flat_map(|page| page.iter().copied().chain([0; 4])).collect())
}

/// A place in a file: near its head, near its end, where E57 and LAZ keep tables, or anywhere.
#[derive(Debug, Clone)]
enum Place {
    Head(usize),
    End(usize),
    Anywhere(Index),
}

impl Place {
    fn of(&self, bytes: &[u8]) -> usize {
        let last = bytes.len().saturating_sub(1);
        match self {
            Place::Head(from_start) => last.min(*from_start),
            Place::End(from_end) => last.saturating_sub(*from_end),
            Place::Anywhere(index) => index.index(last + 1),
        }
    }
}

/// What happens to a file.
#[derive(Debug, Clone)]
enum Damage {
    /// These bytes stand there in place of others: noise, absurd numbers, words of a format.
    Overwrite(Place, Vec<u8>),
    /// These bytes come in.
    Insert(Place, Vec<u8>),
    /// So many bytes are missing.
    Remove(Place, usize),
    /// The rest is missing.
    Cut(Place),
    /// So many bytes stand there several times.
    Repeat(Place, usize, usize),
    /// So many bytes of another file, from a place in it, come in.
    Splice(Place, Index, Place, usize),
}

impl Damage {
    fn apply(&self, bytes: &mut Vec<u8>, others: &[Vec<u8>]) {
        match self {
            Damage::Overwrite(place, with) => {
                let at = place.of(bytes);
                let end = bytes.len().min(at + with.len());
                bytes[at..end].copy_from_slice(&with[..end - at]);
            }
            Damage::Insert(place, new) => {
                let at = place.of(bytes);
                bytes.splice(at..at, new.iter().copied());
            }
            Damage::Remove(place, count) => {
                let at = place.of(bytes);
                bytes.drain(at..bytes.len().min(at + count));
            }
            Damage::Cut(place) => bytes.truncate(place.of(bytes)),
            Damage::Repeat(place, count, times) => {
                let at = place.of(bytes);
                let copies = bytes[at..bytes.len().min(at + count)].repeat(*times);
                bytes.splice(at..at, copies);
            }
            Damage::Splice(place, other, from, count) => {
                let (at, other) = (place.of(bytes), other.get(others));
                let from = from.of(other);
                bytes.splice(at..at, other[from..other.len().min(from + count)].iter().copied());
            }
        }
        if bytes.is_empty() {
            bytes.push(0);
        }
    }
}

fn any_place() -> impl Strategy<Value = Place> {
    prop_oneof![
        3 => (0..600_usize).prop_map(Place::Head),
        1 => (0..1200_usize).prop_map(Place::End),
        2 => any::<Index>().prop_map(Place::Anywhere),
    ]
}

fn any_bytes() -> impl Strategy<Value = Vec<u8>> {
    const ABSURD: [u64; 8] =
        [0, 1, 1 << 31, 1 << 60, i64::MAX as u64, u64::MAX, f64::NAN.to_bits(), f64::MAX.to_bits()];
    const WORDS: [&str; 13] =
        ["1152921504606846976", "-1", "0", "1e999", "nan", " ", "\n", "\"", "<a>", "]]>", "&a;", "list", "x"];
    prop_oneof![
        2 => any::<u8>().prop_map(|byte| vec![byte]),
        1 => vec(any::<u8>(), 1..16),
        1 => (select(&ABSURD[..]), select(&[1_usize, 2, 4, 8][..])).prop_map(|(n, size)| n.to_le_bytes()[..size].into()),
        1 => select(&WORDS[..]).prop_map(|word| word.into()),
    ]
}

fn any_damage() -> impl Strategy<Value = Damage> {
    let (place, bytes) = (any_place, any_bytes);
    prop_oneof![
        4 => (place(), bytes()).prop_map(|(place, with)| Damage::Overwrite(place, with)),
        1 => (place(), bytes()).prop_map(|(place, new)| Damage::Insert(place, new)),
        1 => (place(), 1..2000_usize).prop_map(|(place, count)| Damage::Remove(place, count)),
        1 => place().prop_map(Damage::Cut),
        1 => (place(), 1..200_usize, 1..200_usize).prop_map(|(place, count, times)| Damage::Repeat(place, count, times)),
        1 => (place(), any::<Index>(), place(), 1..2000_usize)
            .prop_map(|(place, other, from, count)| Damage::Splice(place, other, from, count)),
    ]
}

/// Try so many inputs, the same every time; one that fails is made as small as it can be.
fn try_all<S: Strategy>(cases: usize, strategy: &S, test: impl Fn(S::Value)) {
    let config =
        Config { cases: cases as u32, failure_persistence: None, max_shrink_time: 30_000, ..Config::default() };
    let random = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let outcome = TestRunner::new_with_rng(config, random).run(strategy, |value| {
        test(value);
        Ok(())
    });
    outcome.unwrap_or_else(|failure| panic!("{failure}"));
}

#[test]
fn damaged_files_do_no_harm() {
    let _alone = alone();
    let names: Vec<_> = small_fixtures().map(|fixture| fixture.name).collect();
    let files: Vec<_> = names.iter().map(|name| std::fs::read(data().join(name)).unwrap()).collect();
    let input = (0..names.len(), vec(any_damage(), 1..5), any::<bool>());
    try_all(rounds(20) * names.len(), &input, |(number, damages, resealed)| {
        let mut bytes = files[number].clone();
        damages.iter().for_each(|damage| damage.apply(&mut bytes, &files));
        if resealed && names[number].ends_with(".e57") {
            bytes = with_checksums(bytes);
        }
        let _ = survives(&write(&format!("damaged_{}", names[number]), &bytes));
    });
}

#[test]
fn any_bytes_under_any_suffix_do_no_harm() {
    let _alone = alone();
    let suffixes: Vec<_> = formats().iter().flat_map(|(_, suffixes)| suffixes.iter().copied()).collect();
    let line = "([-+]?[0-9]{1,20}([.,][0-9]{0,20})?([eE][-+]?[0-9]{1,4})?[ ,;\t]?|[a-zA-Z#\"]{1,8} ?){0,12}\r?\n";
    let lines = (vec(line, 0..40), select(&["", "ply\n", "VERSION 0.7\n", "# .PCD v0.7\n", "LASF", "ASTM-E57"][..]))
        .prop_map(|(lines, head)| [head.as_bytes(), lines.concat().as_bytes()].concat());
    let content = prop_oneof![3 => lines, 1 => vec(any::<u8>(), 1..2000)];
    try_all(rounds(20) * suffixes.len(), &(select(suffixes), content), |(suffix, bytes)| {
        let bytes = if bytes.is_empty() { vec![b'\n'] } else { bytes };
        let _ = survives(&write(&format!("any.{suffix}"), &bytes));
    });
}

/// The message of the error that reading a file must end in.
fn message(path: &Path) -> String {
    match survives(path) {
        Ok(points) => panic!("{}: {points} points were read", path.display()),
        Err(error) => error.to_string(),
    }
}

#[test]
fn absurd_promises_are_refused_at_once() {
    let _alone = alone();
    // LAS that promises 2^60 points.
    let mut las = std::fs::read(data().join("las14_format6.las")).unwrap();
    las[247..255].copy_from_slice(&(1u64 << 60).to_le_bytes());
    assert!(message(&write("promise.las", &las)).contains("promises 1152921504606846976 points, the file holds 150"));
    let mut laz = std::fs::read(data().join("las14_format6.laz")).unwrap();
    laz[247..255].copy_from_slice(&(1u64 << 60).to_le_bytes());
    assert!(message(&write("promise.laz", &laz)).contains("promises"));
    // E57 whose scans promise 2^60 points, or one too many.
    let e57 = std::fs::read(data().join("e57_double.e57")).unwrap();
    let promising =
        |count: &str| with_xml(&e57, |xml| xml.replace("recordCount=\"50\"", &format!("recordCount=\"{count}\"")));
    assert!(message(&write("promise.e57", &promising("1152921504606846976"))).contains("promises"));
    assert!(!message(&write("promise.e57", &promising("51"))).is_empty());
    let ply = "ply\nformat binary_little_endian 1.0\nelement vertex 1152921504606846976\nproperty float x\nproperty float y\n\
               property float z\nend_header\n0000";
    assert!(message(&write("promise.ply", ply.as_bytes())).contains("cut short"));
    let ply = ply.replace("vertex", "strip").replace("float x", "list int int x")
        + "element vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    assert!(!message(&write("promise_list.ply", ply.replace("end_header\n0000", "").as_bytes())).is_empty());
    let ascii = "ply\nformat ascii 1.0\nelement vertex 1152921504606846976\nproperty float x\nproperty float y\n\
                 property float z\nend_header\n1 2 3\n";
    assert!(message(&write("promise_ascii.ply", ascii.as_bytes())).contains("cut short"));
    for kind in ["ascii", "binary", "binary_compressed"] {
        let pcd = format!(
            "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1152921504606846976\n\
             HEIGHT 1\nPOINTS 1152921504606846976\nDATA {kind}\n1 2 3\n"
        );
        assert!(message(&write("promise.pcd", pcd.as_bytes())).contains("cut short"), "{kind}");
    }
    assert!(message(&write("promise.pts", b"1152921504606846976\n1 2 3\n")).contains("promises"));
    let ptx = "999999999\n999999999\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 2 3 0.5\n";
    assert!(message(&write("promise.ptx", ptx.as_bytes())).contains("cut short"));
}

#[test]
fn bombs_stay_small() {
    let _alone = alone();
    // A compressed PCD whose block repeats one byte over and over: three bytes make 264.
    let block = [0u8, 0].iter().copied().chain([0xe0, 0xff, 0].into_iter().cycle().take(30_000)).collect::<Vec<_>>();
    let points = 200_000_000u32;
    let mut pcd = format!(
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH {points}\nHEIGHT 1\nDATA binary_compressed\n"
    )
    .into_bytes();
    pcd.extend((block.len() as u32).to_le_bytes());
    pcd.extend((points * 12).to_le_bytes());
    pcd.extend(&block);
    assert!(!message(&write("bomb.pcd", &pcd)).is_empty());
    // One endless line.
    let line = vec![b'1'; 4 << 20];
    assert!(!message(&write("line.xyz", &line)).is_empty());
    let mut late = b"1 2 3\n".repeat(20_000);
    late.extend(vec![b' '; 2 << 20]);
    assert!(message(&write("late_line.xyz", &late)).contains("line of more than"));
    // XML whose entities grow, and XML that is deeply nested.
    let e57 = std::fs::read(data().join("e57_double.e57")).unwrap();
    assert_eq!(survives(&write("same.e57", &with_xml(&e57, str::to_owned))).unwrap(), 150);
    let entities: String =
        (1..10).map(|i| format!("<!ENTITY a{i} \"{}\">", format!("&a{};", i - 1).repeat(10))).collect();
    let laughs = format!("<!DOCTYPE e [<!ENTITY a0 \"a\">{entities}]>");
    let bomb = |xml: &str| xml.replacen("<e57Root", &format!("{laughs}<e57Root"), 1).replacen("Setup 2", "&a9;", 1);
    assert!(!message(&write("bomb.e57", &with_xml(&e57, bomb))).is_empty());
    let nested = |xml: &str| xml.replacen("Setup 2", &format!("{}{}", "<a>".repeat(20_000), "</a>".repeat(20_000)), 1);
    let _ = survives(&write("nested.e57", &with_xml(&e57, nested)));
}

#[test]
fn messages_say_what_was_found() {
    let _alone = alone();
    let says = |path: &Path, words: &str| {
        let message = message(path);
        assert!(message.contains(words), "{message}");
        assert!(message.starts_with(&path.display().to_string()), "{message}");
    };
    says(&write("house.laz", b"1 2 3\n"), "expected LAS (first bytes LASF), found text");
    says(&write("house.e57", b"\x00\x01\x02"), "expected E57 (first bytes ASTM-E57), found unknown binary data");
    says(&write("empty.e57", b""), "empty file");
    says(&std::env::temp_dir(), "found a directory");
    says(Path::new("/no/such/file.las"), "No such file");
    says(&write("house.dwg", b"AC1032"), "known suffixes are las, laz, e57, ply, pcd, ptx, pts, xyz");
    says(&write("house.dwg", b"AC1032"), ", asc, evidence");
    says(&write("house.evidence", b"\x00\x01"), "expected evidence (first bytes asbuilt evidence), found unknown");
    says(&write("house.txt", b"\xff\xfe1\x00 \x002\x00"), "UTF-16");
    says(&write("house.csv", b"lat;lon;name\n1;2;3\n4;5;6\n"), "expected columns x, y, z, found lat, lon, name");
    says(&write("words.xyz", b"no numbers here\n"), "expected rows of x, y, z, found \"no numbers here\"");
    says(&write("stray.xyz", b"1 2 3\n4 5 six\n7 8 9\n"), "expected x, y, z at byte 6, found \"4 5 six\"");
    says(&write("grid.asc", b"ncols 3\nnrows 2\n1 2 3\n4 5 6\n"), "raster");
    says(&write("short.pts", b"5\n100.0 200.0 300.0\n400.0 500.0 600.0\n"), "promises 5 points, the file holds 2");
    let e57 = std::fs::read(data().join("e57_double.e57")).unwrap();
    says(&write("cut.e57", &e57[..e57.len() - 1024]), "cut short");
    let mut flipped = e57.clone();
    flipped[200] ^= 1;
    says(&write("flipped.e57", &flipped), "checksum of page 0 is wrong");
    let named_las = scratch("really.txt");
    std::fs::copy(data().join("las12_format3.las"), &named_las).unwrap();
    says(&named_las, "expected XYZ text, found LAS");
}

#[test]
fn content_decides_where_the_suffix_says_nothing() {
    let _alone = alone();
    for name in ["las12_format3.laz", "e57_double.e57", "ply_meshio_binary.ply", "pcd_open3d_binary.pcd"] {
        let path = scratch(&format!("no_suffix_{}", name.replace('.', "_")));
        std::fs::copy(data().join(name), &path).unwrap();
        assert_eq!(survives(&path).unwrap(), 150);
        let shouting = scratch(&name.to_uppercase());
        std::fs::copy(data().join(name), &shouting).unwrap();
        assert_eq!(survives(&shouting).unwrap(), 150);
    }
    assert!(formats().iter().all(|(_, suffixes)| suffixes.iter().all(|s| *s == s.to_lowercase())));
}

#[test]
fn a_file_that_shrinks_while_it_is_read_is_an_error() {
    let _alone = alone();
    for name in [
        "las12_format3.las",
        "las14_format7.laz",
        "e57_double.e57",
        "ply_open3d_binary_double.ply",
        "ply_open3d_ascii.ply",
        "pcd_open3d_binary.pcd",
        "pcd_open3d_compressed.pcd",
        "text_one_block.pts",
        "text_two_scans.ptx",
        "text_cloudcompare.txt",
    ] {
        let path = scratch(&format!("shrinks_{name}"));
        std::fs::copy(data().join(name), &path).unwrap();
        let source = open(&path).unwrap();
        std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(700).unwrap();
        let failed = (0..source.parts()).any(|part| source.read(part, &mut |_| Ok(())).is_err());
        assert!(failed, "{name}");
    }
}
