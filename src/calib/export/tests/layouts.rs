//! Layouts of machines' exports, each in a few lines.

use super::*;

fn close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= 1e-12 * b.abs().max(1e-9), "{found:?} {expected:?}");
    }
}

/// Preamble, results before, quoted numbers, a row of units in brackets.
#[test]
fn bluehill() {
    let text = "Specimen properties : Specimen label,\"gel 3\"\r\nMaximum Load : Maximum Load,\"3.00000\",lbf\r\n\r\n\
        Time,Extension,Load\r\n(s),(in),(lbf)\r\n\"0.00000\",\"0.10000\",\"1.00000\"\r\n\"0.10000\",\"0.20000\",\"2.00000\"\r\n\
        \"0.20000\",\"0.30000\",\"3.00000\"\r\n";
    let export = read(text).expect("a table");
    let table = &export.tables[0];
    let series = table.series(&[Quantity::Extension, Quantity::Force]).expect("SI");
    close(&series.values[0], &[2.54e-3, 5.08e-3, 7.62e-3]);
    close(&series.values[1], &[4.448_221_615_260_5, 8.896_443_230_521, 13.344_664_845_781_5]);
    assert_eq!(series.lines, [6, 7, 8]);
    let agrees = |f: &Finding| f.weight == Weight::Note && f.text.contains("Maximum Load is 3.00000 lbf");
    assert!(table.findings.iter().any(agrees), "{:?}", table.findings);
}

/// A table of results above, another below.
#[test]
fn results_before_and_after() {
    let text = "Results\nSpecimen,Modulus (MPa),Stress at break (MPa)\n1,0.1,0.5\n2,0.2,0.6\nMean,0.15,0.55\n\nTime (s),Load (N)\n0,0\n1,1\n\
        2,2\n3,3\n\nRow,Peak (N),Energy (J)\n1,3.0,4.0\n2,3.1,4.1\nMean,3.05,4.05\n";
    let export = read(text).expect("a table");
    assert_eq!(export.tables.len(), 1, "{export}");
    close(&export.tables[0].series(&[Quantity::Force]).expect("SI").values[0], &[0.0, 1.0, 2.0, 3.0]);
    let shown = export.to_string();
    assert!(shown.contains("left out   lines 3 to 5") && shown.contains("lines 14 to 16"), "{shown}");
}

/// German: decimal comma, thousands with points, cp1252, units in their own row.
#[test]
fn testxpert() {
    let text = "Prüfer;Müller\nMesslänge;50;mm\nPrüfzeit;Standardkraft;Standardweg;Dehnung\ns;N;mm;%\n0,0;0,5;0,00;0,0\n\
        0,5;1.234,5;25,00;50,0\n1,0;2.000,0;50,00;100,0\n";
    let bytes = encoding_rs::WINDOWS_1252.encode(text).0.into_owned();
    let export = read_bytes(Path::new("a.tra"), bytes, &Override::default()).expect("a table");
    let table = &export.tables[0];
    let series = table.series(&[Quantity::Force, Quantity::Extension, Quantity::Strain]).expect("SI");
    close(&series.values[0], &[0.5, 1234.5, 2000.0]);
    close(&series.values[1], &[0.0, 0.025, 0.05]);
    close(&series.values[2], &[0.0, 0.5, 1.0]);
    assert_eq!(table.specimen.gauge_length_m, Some(0.05));
}

/// Russian: cp1251, decimal comma, units behind commas, a pull negative.
#[test]
fn a_negative_pull_is_turned() {
    let text = "Образец: 1\nВремя, с;Нагрузка, кгс;Перемещение, мм\n0;0;0\n0,5;-1,5;1,5\n1;-3;3\n1,5;-4;4\n";
    let bytes = encoding_rs::WINDOWS_1251.encode(text).0.into_owned();
    let export = read_bytes(Path::new("a.csv"), bytes, &Override::default()).expect("a table");
    let force = export.tables[0].column(Quantity::Force).expect("there");
    assert!(force.turned);
    close(&force.si().expect("SI"), &[0.0, 14.709_975, 29.419_95, 39.2266]);
    let text = "Tensile test\nt (s),Load (N),Position (mm)\n0,0,0\n1,-1,-1\n2,-2,-2\n";
    let export = read(text).expect("a table");
    assert!(export.tables[0].column(Quantity::Force).expect("there").turned);
    assert!(export.tables[0].column(Quantity::Extension).expect("there").turned);
    let export = read_with(text, "pull = 'positive'").expect("a table");
    assert!(!export.tables[0].column(Quantity::Force).expect("there").turned);
    let compressed = read(&text.replace("Tensile", "Compression")).expect("a table");
    assert!(!compressed.tables[0].column(Quantity::Force).expect("there").turned);
}

/// Chinese, GBK.
#[test]
fn chinese() {
    let text = "试样编号,1\n标距(mm),25\n时间(s),负荷(kN),位移(mm),变形(mm),应力(MPa)\n0.1,0.01,0.1,0.05,0.5\n0.2,0.02,0.2,0.1,1.0\n0.3,0.03,0.3,0.15,1.5\n";
    let bytes = encoding_rs::GBK.encode(text).0.into_owned();
    let export = read_bytes(Path::new("a.csv"), bytes, &Override::default()).expect("a table");
    let table = &export.tables[0];
    close(&table.series(&[Quantity::Stress]).expect("SI").values[0], &[5e5, 1e6, 1.5e6]);
    assert!(table.column(Quantity::Extension).is_err(), "crosshead and extensometer differ");
    assert_eq!(table.specimen.gauge_length_m, Some(0.025));
}

#[test]
fn two_specimens_in_every_way() {
    let blocks = "t (s),F (N)\n0,0\n1,1\n\nt (s),F (N)\n0,0\n1,5\n";
    let column = "Specimen,t (s),F (N)\nA,0,0\nA,1,1\nB,0,0\nB,1,5\n";
    let side = "t (s),F (N),t (s),F (N)\n0,0,0,0\n1,1,1,5\n2,2,,\n";
    let labels = "t (s),F (N)\nSpecimen 1\n0,0\n1,1\nSpecimen 2\n0,0\n1,5\n";
    for (text, names) in
        [(blocks, ["1", "2"]), (column, ["A", "B"]), (side, ["1", "2"]), (labels, ["1", "2"])]
    {
        let export = read(text).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_eq!(export.tables.iter().map(|t| t.label.as_str()).collect::<Vec<_>>(), names, "{text}");
        let second = export.tables[1].series(&[Quantity::Time, Quantity::Force]).expect("SI");
        close(&second.values[1], &[0.0, 5.0]);
    }
    let error = read("t (s),F (N)\n0,0\n1,1\n0,0\n1,5\n").expect_err("goes back").to_string();
    assert!(error.contains("second specimen"), "{error}");
}

#[test]
fn absent_cells_are_absent_and_peaks_apart() {
    let text = "Time (s),Load (N),Load_P&V (N),Time_P&V (s)\n0,0,,\n1,1,4,0.5\n2,,,\n3,3,-4,2.5\n";
    let export = read(text).expect("a table");
    let table = &export.tables[0];
    let series = table.series(&[Quantity::Time, Quantity::Force]).expect("SI");
    close(&series.values[1], &[0.0, 1.0, 3.0]);
    assert_eq!(series.lines, [2, 3, 5]);
    let peaks = table.columns.iter().find(|c| c.heading.starts_with("Load_P&V")).expect("kept");
    assert_eq!((peaks.rows.as_slice(), peaks.extreme), ([1, 3].as_slice(), true));
}

#[test]
fn units_that_contradict_one_another_are_named() {
    let rows = |f: &dyn Fn(f64) -> String| (0..8).map(|i| f(f64::from(i))).collect::<String>();
    for (head, row, words) in [
        // Inches that are millimetres.
        (
            "t (s),Position (in),Extension (mm)",
            &(|i| format!("{i},{i},{i}\n")) as &dyn Fn(f64) -> String,
            "would fit in mm",
        ),
        // Stress against a stated cross-section: kPa that are MPa.
        (
            "Area;18;mm2\nt (s),Load (N),Stress (kPa)",
            &|i| format!("{i},{},{i}\n", 18.0 * i),
            "would fit in MPa",
        ),
        // Strain against a gauge length: per cent that are ratios.
        (
            "Gauge length (mm),33\nt (s),Extension (mm),Strain (%)",
            &|i| format!("{i},{},{i}\n", 33.0 * i),
            "would fit in mm/mm",
        ),
        // True strain.
        (
            "t (s),Strain (mm/mm),True strain (mm/mm)",
            &|i| format!("{i},{},{}\n", 20.0 * i, (0.2 * i).ln_1p()),
            "fits %",
        ),
        (
            "Thickness (mm),3\nWidth (mm),6\nArea (mm2),25\nt (s),Load (N)",
            &|i| format!("{i},{i}\n"),
            "sizes give 18.0000 mm²",
        ),
        ("Maximum load (N),20\nt (s),Load (N)", &|i| format!("{i},{i}\n"), "Load (N) goes to 7"),
        ("t (s),Load (mm)", &|i| format!("{i},{i}\n"), "measures a length, the name says force"),
        ("t (s),Extension (m)", &|i| format!("{i},{}\n", 10.0 * i), "no test does"),
    ] {
        let text = format!("{}\n{}", head.replace(';', ","), rows(row));
        let export = read(&text).unwrap_or_else(|e| panic!("{text}: {e}"));
        let said = |f: &Finding| f.weight == Weight::Contradiction && f.text.contains(words);
        assert!(export.tables[0].findings.iter().any(said), "{words}\n{export}");
    }
}

#[test]
fn units_that_are_not_given_are_shown_by_ratios_only() {
    let rows: String = (0..9).map(|i| format!("{i},{},{}\n", 33 * i, 0.5 * f64::from(i))).collect();
    let open = read(&format!("t (s),Extension (mm),Strain\n{rows}")).expect("a table");
    assert!(open.tables[0].series(&[Quantity::Strain]).is_err());
    let rows: String = (0..9).map(|i| format!("{i},{},{}\n", 33 * i, 100 * i)).collect();
    let shown = read(&format!("Gauge length (mm),33\nt (s),Extension (mm),Strain\n{rows}")).expect("a table");
    close(&shown.tables[0].series(&[Quantity::Strain]).expect("per cent").values[0][..3], &[0.0, 1.0, 2.0]);
}

#[test]
fn a_workbook_and_its_sheets() {
    let mut book = rust_xlsxwriter::Workbook::new();
    for (name, scale) in [("Probe 1", 1.0), ("Probe 2", 2.0)] {
        let sheet = book.add_worksheet().set_name(name).expect("a name");
        for (column, (heading, unit)) in [("Dehnung", "%"), ("Standardkraft", "N")].into_iter().enumerate() {
            sheet.write(2, column as u16 + 1, heading).expect("written");
            sheet.write(3, column as u16 + 1, unit).expect("written");
            for row in 0..5_u32 {
                sheet.write(4 + row, column as u16 + 1, f64::from(row) * scale).expect("written");
            }
        }
    }
    book.add_worksheet().set_name("Notes").expect("a name").write(0, 0, "nothing here").expect("written");
    let bytes = book.save_to_buffer().expect("a workbook");
    let export = read_bytes(Path::new("a.xlsx"), bytes.clone(), &Override::default()).expect("tables");
    assert_eq!(export.tables.iter().map(|t| t.label.as_str()).collect::<Vec<_>>(), ["Probe 1", "Probe 2"]);
    let series = export.tables[1].series(&[Quantity::Strain, Quantity::Force]).expect("SI");
    close(&series.values[0], &[0.0, 0.02, 0.04, 0.06, 0.08]);
    assert_eq!((series.lines[0], export.tables[1].columns[0].place.column), (5, 2));
    let wish = Override::parse(Path::new("w"), "sheet = 'Probe 9'").expect("sound");
    let error = read_bytes(Path::new("a.xlsx"), bytes, &wish).expect_err("no such sheet").to_string();
    assert!(error.contains("there are Probe 1, Probe 2, Notes"), "{error}");
    let error =
        read_bytes(Path::new("a.xlsx"), b"PK\x03\x04junk".to_vec(), &Override::default()).expect_err("junk");
    assert!(error.to_string().contains("a.xlsx: not a workbook"), "{error}");
}

#[test]
fn a_folder_keeps_bytes_and_order() {
    let folder = tempfile::tempdir().expect("a folder");
    for n in [10, 9, 1] {
        let text = format!("t (s),F (N)\n0,0\n1,{n}\n");
        std::fs::write(folder.path().join(format!("Specimen_RawData_{n}.csv")), text).expect("written");
    }
    std::fs::write(folder.path().join("results.csv"), "Modulus\n3\n").expect("written");
    let read = read_folder(folder.path(), &Override::default()).expect("exports");
    let last = |e: &Export| e.tables[0].columns[1].printed[1];
    assert_eq!(read.exports.iter().map(last).collect::<Vec<_>>(), [1.0, 9.0, 10.0]);
    assert_eq!(read.refused.len(), 1);
    assert_eq!(read.exports[0].source.bytes, b"t (s),F (N)\n0,0\n1,1\n");
    assert_eq!(read.exports[0].source.sha256.len(), 64);
}

#[test]
fn times_of_day_are_seconds() {
    let text = "Time;Load (N)\n0:00:59,5;1\n0:01:00,0;2\n1:00:00,5;3\n";
    let export = read(text).expect("a table");
    close(&export.tables[0].series(&[Quantity::Time]).expect("SI").values[0], &[59.5, 60.0, 3600.5]);
}

#[test]
fn trailing_separators_blank_lines_and_cut_ends() {
    let text = "t (s);F (N);;\n\n0;0;;\n1;1;;\n\n2;2;;\n3";
    let export = read(text).expect("a table");
    close(&export.tables[0].series(&[Quantity::Force]).expect("SI").values[0], &[0.0, 1.0, 2.0]);
    assert!(export.to_string().contains("line 7: cut off after 1 of 2 fields"), "{export}");
}
