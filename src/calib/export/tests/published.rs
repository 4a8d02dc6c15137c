//! Measurements of others, read in place: `PHANTOM_RIG_DATA`, or `../shared` beside the project. Without them nothing is tested.

use super::*;
use std::path::PathBuf;

fn folder(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("PHANTOM_RIG_DATA")
        .map(PathBuf::from)
        .unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"));
    let found = [root.join("data").join(name), root.join(name)].into_iter().find(|f| f.is_dir());
    if found.is_none() {
        println!("skipped: no data");
    }
    found
}

fn read(folder_name: &str, file: &str) -> Option<Export> {
    let file = folder(folder_name)?.join(file);
    let export = read_file(&file, &Override::default()).unwrap_or_else(|e| panic!("{e}"));
    println!("{export}");
    Some(export)
}

fn contradictions(table: &Table) -> Vec<&Finding> {
    table.findings.iter().filter(|f| f.weight == Weight::Contradiction).collect()
}

fn note(table: &Table, words: &str) -> bool {
    table.findings.iter().any(|f| f.weight == Weight::Note && f.text.contains(words))
}

/// Speed, gauge length and cross-section of its preambles, the same in all three: 450 mm/min, 33 mm, 3 mm × 6 mm.
#[test]
fn pull_to_failure_of_three_silicones() {
    for (file, rows) in [("Dragon Skin 20.csv", 404), ("Ecoflex 00-10.csv", 751), ("Ecoflex 00-30.csv", 705)]
    {
        let Some(export) = read("tensile", file) else { return };
        let table = &export.tables[0];
        assert!(contradictions(table).is_empty(), "{export}");
        assert_eq!((table.lines.len(), table.lines[0], table.loading), (rows, 19, Some(Loading::Tension)));
        assert_eq!(table.column(Quantity::Strain).expect("there").source, Some(StrainSource::Crosshead));
        assert!((table.specimen.gauge_length_m.expect("said") - 0.033).abs() < 1e-12);
        assert!((table.specimen.area_m2().expect("said") - 18e-6).abs() < 1e-15);
        let series = table.series(&[Quantity::Time, Quantity::Strain, Quantity::Stress]).expect("SI");
        // 450 mm/min over 33 mm, though one file counts its times on: 40.9, 40.10.
        let last = rows - 1;
        let rate =
            (series.values[1][last] - series.values[1][0]) / (series.values[0][last] - series.values[0][0]);
        assert!((rate * 0.033 / 7.5e-3 - 1.0).abs() < 2e-3, "{file}: {rate}");
        assert_eq!(note(table, "would go back"), file == "Ecoflex 00-30.csv");
        assert!(note(table, "as it should be"), "{export}");
    }
}

#[test]
fn times_that_are_counted_on_are_refused_as_decimals() {
    let Some(folder) = folder("tensile") else { return };
    let wish = Override { time: Some(TimeStyle::Decimal), ..Override::default() };
    let error = read_file(&folder.join("Ecoflex 00-30.csv"), &wish).expect_err("goes back").to_string();
    assert!(
        error.contains("line 426, column 1 (Time (s)): \"40.10\" comes after \"40.9\" in line 425"),
        "{error}"
    );
}

#[test]
fn bluehill_in_inches_and_pounds() {
    let Some(export) = read("tensile", "bluehill_bend_in_lbf.csv") else { return };
    let table = &export.tables[0];
    assert_eq!((table.lines.len(), table.loading), (5_977, Some(Loading::Flexure)));
    assert!(contradictions(table).is_empty() && note(table, "Maximum Load is 131.18347 lbf"), "{export}");
    let series = table.series(&[Quantity::Extension, Quantity::Force]).expect("SI");
    assert!((series.values[0][0] - 0.71953 * 0.0254).abs() < 1e-12);
    assert!((series.values[1][0] - 15.15737 * 4.448_221_615_260_5).abs() < 1e-9);
    let Some(export) = read("tensile", "bluehill_cyclic.csv") else { return };
    let series =
        export.tables[0].series(&[Quantity::Time, Quantity::Extension, Quantity::Force]).expect("SI");
    assert_eq!(series.lines.len(), 222);
    assert!((series.values[1][0] - 1.2556e-3).abs() < 1e-12 && (series.values[2][0] - 5.16404).abs() < 1e-12);
}

#[test]
fn a_strain_in_pounds_is_named() {
    let Some(export) = read("tensile", "wavematrix_hydrogel.csv") else { return };
    let table = &export.tables[0];
    let found = contradictions(table);
    let [wrong] = found.as_slice() else { panic!("{export}") };
    assert_eq!(wrong.place.column, 7);
    for part in ["Ch:Strain (lbs)", "measures a force", "mm/mm over 5.0000 mm"] {
        assert!(wrong.text.contains(part), "{wrong}");
    }
    assert!(note(table, "S:Position (in) and Ch:Position (mm) hold the same"), "{export}");
    assert!(note(table, "19.6300 mm², round 4.9994 mm across"), "{export}");
    assert!(table.series(&[Quantity::Strain]).is_err());
    assert_eq!(
        table.series(&[Quantity::Time, Quantity::Force, Quantity::Stress]).expect("SI").lines.len(),
        11_130
    );
    let wish = "[column.'Ch:Strain (lbs)']\nunit = 'mm/mm'";
    let wish = Override::parse(Path::new("wishes.toml"), wish).expect("sound");
    let export = read_file(&export.source.file, &wish).expect("read");
    let strain = export.tables[0].series(&[Quantity::Strain]).expect("said");
    assert!((strain.values[0][11_129] - 0.741_332).abs() < 1e-12);
}

#[test]
fn foam_in_compression_is_negative() {
    for (file, rows) in
        [("VN_foam_0DA_ramp_hold_unload.csv", 2_384), ("VN_foam_1DA_ramp_hold_unload.csv", 15_190)]
    {
        let Some(export) = read("foam", file) else { return };
        let table = &export.tables[0];
        assert!(contradictions(table).is_empty(), "{export}");
        let series = table.series(&[Quantity::Time, Quantity::Gap, Quantity::Force]).expect("SI");
        assert_eq!(series.lines.len(), rows);
        let least = series.values[2].iter().copied().fold(f64::INFINITY, f64::min);
        assert!((-7.0..-3.0).contains(&least), "{least}");
    }
}

/// The files name no units; what they are stands elsewhere.
#[test]
fn columns_without_units_wait_for_a_word() {
    let Some(export) = read("rates", "AvgMava_pCa4.4_1s.csv") else { return };
    assert!(export.tables[0].series(&[Quantity::Time]).is_err());
    let wish =
        "[column.Time]\nunit = 's'\n[column.L]\nunit = 'um'\n[column.F]\nquantity = 'stress'\nunit = 'kPa'";
    let wish = Override::parse(Path::new("wishes.toml"), wish).expect("sound");
    let folder = folder("rates").expect("there");
    for export in read_folder(&folder, &wish).expect("exports").exports {
        let series =
            export.tables[0].series(&[Quantity::Time, Quantity::Gap, Quantity::Stress]).expect("said");
        assert_eq!(series.lines.len(), 100);
        assert!((0.9e-6..1.0e-6).contains(&series.values[1][0]));
    }
}
