//! What is wrong with an export is said with file, line and column.

use super::*;

#[test]
fn each_fault_is_named_with_its_place() {
    for (text, words) in [
        ("", "a.csv: the file is empty"),
        (" \n\n", "a.csv: the file is empty"),
        ("only words\nin here\n", "a.csv: no table in its 2 lines"),
        ("Time (s),Load (N)\n", "a.csv: no table"),
        ("Time (s),Load (N)\n0,1\n", "a.csv, line 2: the table has 1 row; at least 2 are needed"),
        (
            "Time (s),Load (N)\n0,1\n1,two\n2,3\n",
            "a.csv, line 3, column 2 (Load (N)): \"two\" is not a number",
        ),
        (
            "Time (s),Load (N),Weg (mm)\n0,1,2\n1,two,2\n2,3,2\n",
            "a.csv, line 3, column 2 (Load (N)): \"two\" is not a number with the decimal sign '.'",
        ),
        ("Time (s),Load (N),Weg (mm)\n0,1,2\n1,2.5 N,2\n2,3,2\n", "line 3, column 2 (Load (N)): \"2.5 N\""),
        ("Time (s);Load (N)\n0,5;1,5\n1.5;2\n", "a.csv, line 3, column 1: \"1.5\" has another decimal sign"),
        (
            "Time (s),Load (N)\n0.1,1\n0.2,2\n0.15,3\n",
            "a.csv, line 4, column 1 (Time (s)): \"0.15\" comes after \"0.2\" in line 3: time goes back",
        ),
        (
            "Time (s),Load (N)\n0.1,1\n0.2,1e999\n0.3,3\n",
            "a.csv, line 3, column 2 (Load (N)): \"1e999\" is too large",
        ),
        (
            "Time (s),Load (N)\n0.1,1\n0.2,2,3\n0.3,3\n",
            "a.csv, line 3: 3 fields where the names are 2; the last is \"3\"",
        ),
        ("0.1,1\n0.2,2\n", "a.csv, line 1: the numbers begin here, and no names"),
        (
            "Time,Load (N)\n(min),(kN)\n0.1,1\n0.2,2\n",
            "a.csv, line 2, column 2: the heading \"Load (N)\" says \"N\", the row of units says \"kN\"",
        ),
        (
            "Time (s);Load (N)\n1,234;2,345\n2,345;3,456\n",
            "a.csv, line 2, column 1: \"1,234\" may be 1.234 or 1234",
        ),
    ] {
        let error = read(text).expect_err(text).to_string();
        assert!(error.contains(words), "{text:?}\n{error}\n{words}");
    }
}

#[test]
fn what_is_not_there_or_not_known_is_said_when_it_is_asked_for() {
    let text = "Time (s),Load,Strain (lbs),Weg (mm)\n0,0,0,0\n1,1,0.1,1\n2,2,0.2,2\n3,3,0.3,3\n";
    let export = read(text).expect("a table");
    let table = &export.tables[0];
    for (quantity, words) in [
        (Quantity::Stress, "a.csv, line 1: no column holds stress; there are \"Time (s)\", \"Load\""),
        (Quantity::Force, "a.csv, line 1, column 2 (Load): no unit is given that is known: say unit"),
        (
            Quantity::Strain,
            "a.csv, line 1, column 3 (Strain (lbs)): the unit \"lbf\" measures a force, the name says strain",
        ),
    ] {
        let error = table.series(&[Quantity::Time, quantity]).expect_err("refused").to_string();
        assert!(error.contains(words), "{error}");
    }
    let wish = "[column.Load]\nunit = 'lbf'\n[column.'Strain (lbs)']\nunit = 'mm/mm'";
    let export = read_with(text, wish).expect("a table");
    let series = export.tables[0].series(&[Quantity::Strain, Quantity::Force]).expect("said");
    assert_eq!(series.values[0], [0.0, 0.1, 0.2, 0.3]);
    assert!((series.values[1][1] - 4.448_222).abs() < 1e-6);
    assert_eq!(series.lines, [2, 3, 4, 5]);
}

#[test]
fn numbers_without_names_are_named_by_a_wish() {
    let export =
        read_with("a note\n0.5,1\n1.5,2\n", "names = ['Time (min)', 'Load (kgf)']").expect("a table");
    let series = export.tables[0].series(&[Quantity::Time, Quantity::Force]).expect("SI");
    assert_eq!(
        (series.values[0].as_slice(), series.lines.as_slice()),
        ([30.0, 90.0].as_slice(), [2, 3].as_slice())
    );
}

#[test]
fn a_wish_for_a_column_that_is_not_there_is_refused() {
    let text = "Time (s),Load (N)\n0,1\n1,2\n";
    let error = read_with(text, "[column.'Laod (N)']\nunit = 'kN'").expect_err("no such column").to_string();
    assert!(error.contains("names no column") && error.contains("Load (N)"), "{error}");
    let error = read_with(text, "names_line = 9").expect_err("no such line").to_string();
    assert!(error.contains("names_line = 9"), "{error}");
}

#[test]
fn an_empty_folder_and_a_missing_file_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let error = read_folder(folder.path(), &Override::default()).expect_err("empty").to_string();
    assert!(error.contains("no file in it has the name of an export"), "{error}");
    let missing = folder.path().join("none.csv");
    let error = read_file(&missing, &Override::default()).expect_err("missing").to_string();
    assert!(error.contains("none.csv"), "{error}");
    std::fs::write(folder.path().join("bad.csv"), "nothing").expect("written");
    let error = read_folder(folder.path(), &Override::default()).expect_err("bad").to_string();
    assert!(error.contains("bad.csv: no table"), "{error}");
}
