//! Whether anything that could arrive makes the decoders panic: seeded random inputs, as many as `FUZZ_INPUTS` says.

use super::configuration::NetFtConfiguration;
use super::rdt;
use crate::clock::HostTime;
use proptest::prelude::*;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn inputs(short: u64) -> u64 {
    std::env::var("FUZZ_INPUTS").ok().map_or(short, |n| n.parse().expect("FUZZ_INPUTS is a number"))
}

/// Every length that a datagram can have, mostly near those of records.
#[test]
fn no_datagram_makes_the_decoder_panic() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut bytes = [0; 1500];
    let mut read = 0;
    let inputs = inputs(20_000);
    for _ in 0..inputs {
        let near = rdt::RECORD_BYTES * random.random_range(0..42)
            + random.random_range(0..3_usize).saturating_sub(1);
        let length = if random.random_bool(0.8) { near } else { random.random_range(0..=bytes.len()) };
        let datagram = &mut bytes[..length.min(1500)];
        random.fill_bytes(datagram);
        let records = rdt::records(datagram, HostTime::from_nanos(0)).map(Iterator::count);
        let sound = datagram.len() % rdt::RECORD_BYTES == 0
            && (1..=40).contains(&(datagram.len() / rdt::RECORD_BYTES));
        assert_eq!(records, sound.then_some(datagram.len() / rdt::RECORD_BYTES));
        read += records.unwrap_or(0);
    }
    println!("{inputs} datagrams, {read} records");
}

const PAGE: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<netft><runstat>0x00000000</runstat><runrate>7000</runrate>\
    <prodname>Net F/T</prodname><cfgnam>a &amp; b</cfgnam><cfgcalsn>FT1</cfgcalsn><cfgfu>2</cfgfu><scfgfu>N</scfgfu><cfgtu>3</cfgtu>\
    <scfgtu>N-m</scfgtu><cfgcpf>1000000</cfgcpf><cfgcpt>1000000;2</cfgcpt><cfgmr>1;2;3;4;5;6</cfgmr><setcfgsel>0</setcfgsel>\
    <comrdtrate>7000</comrdtrate><comrdtbsiz>40</comrdtbsiz></netft>";

const PIECES: [&str; 16] = [
    "<",
    ">",
    "/",
    "</netft>",
    "<netft>",
    "<cfgcpf>",
    "&",
    "&#x110000;",
    "&#0;",
    ";",
    "<![CDATA[",
    "]]>",
    "<!--",
    "<!DOCTYPE",
    "é",
    "-1e999",
];

/// A sound page with bytes changed, pieces left out, doubled and put in.
#[test]
fn no_page_makes_the_parser_panic() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let inputs = inputs(2_000);
    let (mut sound, mut refused) = (0_u64, 0_u64);
    for _ in 0..inputs {
        let mut page = PAGE.as_bytes().to_vec();
        for _ in 0..random.random_range(0..4) {
            let a = random.random_range(0..page.len());
            let b = random.random_range(a..page.len().min(a + 40));
            match random.random_range(0..5) {
                0 => page[a] = random.random(),
                1 => drop(page.drain(a..b)),
                2 => drop(page.splice(a..a, page[a..b].to_vec()).count()),
                3 => drop(page.splice(a..b, PIECES[random.random_range(0..PIECES.len())].bytes()).count()),
                _ => page.truncate(a.max(1)),
            }
            if page.is_empty() {
                break;
            }
        }
        match NetFtConfiguration::parse(&page) {
            Ok(read) => {
                assert!(read.counts_per_newton > 0.0 && read.counts_per_newton_metre > 0.0, "{read:?}");
                assert!(read.rate_hz > 0.0 && read.tick_hz >= read.rate_hz, "{read:?}");
                sound += 1;
            }
            Err(error) => {
                assert!(!error.to_string().is_empty());
                refused += 1;
            }
        }
    }
    println!("{inputs} pages: {sound} read, {refused} refused");
    assert!(sound > 0 && refused > 0);
}

proptest! {
    #[test]
    fn no_bytes_make_the_parser_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(NetFtConfiguration::parse(&bytes).is_err());
    }

    #[test]
    fn no_text_makes_the_parser_panic(text in "<netft>(<(cfgcpf|cfgcpt|scfgfu|cfgmr)>\\PC{0,12}</(cfgcpf|scfgfu)>|\\PC{0,20}){0,8}(</netft>)?") {
        let _ = NetFtConfiguration::parse(text.as_bytes());
    }
}
