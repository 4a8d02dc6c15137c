//! Whether any bytes make the reader panic: seeded mutations of sound exports, as many as `FUZZ_INPUTS` says.

use super::*;
use rand::rngs::StdRng;
use rand::{Rng, RngExt, SeedableRng};

const SOUND: [&str; 4] = [
    "Max : Load,\"3.0\",lbf\n\nTime,Extension,Load\n(s),(in),(lbf)\n\"0.0\",\"0.1\",\"1.0\"\n\"0.1\",\"0.2\",\"2.0\"\n\"0.2\",\"0.3\",\"3.0\"\n",
    "Messlänge;50;mm\nZeit;Kraft;Dehnung\ns;N;%\n0,0;1.234,5;0,0\n0,5;2,5;5,0\n1,0;3,5;9,5\n\nMittelwert;1,0;2,0\n",
    "Specimen\tt (s)\tF (kN)\tStrain (lbs)\tTrue strain\nA\t0\t0\t0\t0\nA\t1\t1\t1\t0.69\nB\t0\t0\t0\t0\nB\t1\t-2\t2\t1.1\n",
    "时间(s) 负荷(N) 位移(mm)\n0.1 2.5 3\n0.2 3.5 4\n0.3 4.5 5\n",
];

const PIECES: [&str; 22] = [
    "\"",
    "\"\"",
    ",",
    ";",
    "\t",
    "\n",
    "\r",
    "\r\n\r\n",
    "1e999",
    "-",
    "−",
    "nan",
    "()",
    "(mm)",
    "%",
    "1.234",
    "1,234",
    "Specimen 2\n",
    "\u{feff}",
    "\0",
    "é",
    "t (s),F (N)\n",
];

fn mutate(random: &mut StdRng, bytes: &mut Vec<u8>) {
    for _ in 0..random.random_range(0..5) {
        if bytes.is_empty() {
            return;
        }
        let a = random.random_range(0..bytes.len());
        let b = random.random_range(a..bytes.len().min(a + 40));
        match random.random_range(0..6) {
            0 => bytes[a] = random.random(),
            1 => drop(bytes.drain(a..b)),
            2 => drop(bytes.splice(a..a, bytes[a..b].to_vec())),
            3 | 4 => drop(bytes.splice(a..b, PIECES[random.random_range(0..PIECES.len())].bytes())),
            _ => bytes.truncate(a),
        }
    }
}

fn wishes(random: &mut StdRng) -> Override {
    let texts = [
        "",
        "",
        "",
        "decimal = ','",
        "delimiter = ';'",
        "names_line = 3",
        "encoding = 'gbk'",
        "time = 'counted'",
        "names = ['a', 'b (mm)']",
    ];
    Override::parse(Path::new("w"), texts[random.random_range(0..texts.len())]).expect("sound")
}

/// Everything that is done with an export.
fn use_all(bytes: Vec<u8>, wish: &Override) -> bool {
    match read_bytes(Path::new("a.csv"), bytes, wish) {
        Ok(export) => {
            for table in &export.tables {
                for column in &table.columns {
                    assert!(column.printed.iter().all(|v| v.is_finite()));
                    let _ = table.series(&[Quantity::Time, column.quantity]);
                }
            }
            !export.to_string().is_empty()
        }
        Err(error) => error.to_string().is_empty(),
    }
}

#[test]
fn no_bytes_make_the_reader_panic() {
    let inputs: u64 = std::env::var("FUZZ_INPUTS").ok().map_or(5_000, |n| n.parse().expect("a number"));
    let mut random = StdRng::seed_from_u64(3);
    let mut read = 0_u64;
    for i in 0..inputs {
        let text = SOUND[random.random_range(0..SOUND.len())];
        let mut bytes = match i % 4 {
            0 => encoding_rs::WINDOWS_1252.encode(text).0.into_owned(),
            1 => text.encode_utf16().flat_map(u16::to_le_bytes).collect(),
            _ => text.as_bytes().to_vec(),
        };
        mutate(&mut random, &mut bytes);
        if i % 50 == 0 {
            bytes = vec![0; random.random_range(0..200)];
            random.fill_bytes(&mut bytes);
        }
        let wish = wishes(&mut random);
        read += u64::from(use_all(bytes, &wish));
    }
    println!("{inputs} inputs, {read} read");
    assert!(10 * read > inputs, "some mutations leave a table");
}

#[test]
fn no_workbook_makes_the_reader_panic() {
    let inputs: u64 =
        std::env::var("FUZZ_INPUTS").ok().map_or(300, |n| n.parse::<u64>().expect("a number") / 20);
    let mut book = rust_xlsxwriter::Workbook::new();
    let sheet = book.add_worksheet();
    for (column, heading) in ["t (s)", "F (N)"].into_iter().enumerate() {
        sheet.write(0, column as u16, heading).expect("written");
        for row in 1..6_u32 {
            sheet.write(row, column as u16, row).expect("written");
        }
    }
    let sound = book.save_to_buffer().expect("a workbook");
    let mut random = StdRng::seed_from_u64(4);
    for _ in 0..inputs {
        let mut bytes = sound.clone();
        for _ in 0..random.random_range(1..6) {
            let at = random.random_range(4..bytes.len());
            bytes[at] = random.random();
        }
        use_all(bytes, &Override::default());
    }
}
