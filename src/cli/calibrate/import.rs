//! `calibrate import`: exports of testing machines into tables in SI, the originals kept beside them.

use crate::calib::export::{Column, Export, Override, Quantity, Table, Weight, read_file, read_folder};
use crate::cli::{Context, Exit, Kind, Outcome, StagedFolder};
use crate::units::counted;
use anyhow::{Context as _, bail};
use clap::Args;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Reads exports of testing machines: time, extension, force, stress and strain of each specimen, in SI.
///
/// Bluehill, testXpert, MTS and plain tables, also Excel's; encoding, separators, decimal comma, names and units are inferred, and what was
/// inferred is printed with what shows it. A unit that its numbers contradict is named, never guessed over: such a column is left out until an
/// override says what it holds. Writes a table a specimen (CSV with a row of units), import.txt (what was inferred), import.json, and
/// the originals with their hashes.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig calibrate import 'exports/Dragon Skin 20.csv' --out calibration/dragon-skin
  phantom-rig calibrate import exports/monday --as calibration/monday.toml --out calibration/monday

Keys of an override (TOML, all may be left out):
  encoding, delimiter, decimal, thousands, names_line, units_line, sheet, names = [\"…\"], pull = \"positive\" | \"negative\",
  time = \"decimal\" | \"counted\"; [column.\"Heading\"] quantity, unit, ignore;
  [specimen] thickness_mm, width_mm, diameter_mm, area_mm2, gauge_length_mm")]
pub(in crate::cli) struct ImportArguments {
    /// Exports, or folders of them
    #[arg(value_name = "EXPORT", required = true, num_args = 1..)]
    exports: Vec<PathBuf>,
    /// What is known better than can be inferred
    #[arg(long = "as", value_name = "FILE")]
    wish: Option<PathBuf>,
    /// Where the tables go; an earlier result there is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace whatever is there
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &ImportArguments, _: &Context) -> anyhow::Result<Outcome> {
    let wish = arguments.wish.as_deref().map_or_else(|| Ok(Override::default()), Override::read)?;
    let mut exports: Vec<Export> = Vec::new();
    let mut refused: Vec<(PathBuf, String)> = Vec::new();
    for source in &arguments.exports {
        if source.is_dir() {
            let folder = read_folder(source, &wish)?;
            exports.extend(folder.exports);
            let with_cause = |why| format!("{:#}", anyhow::Error::from(why));
            refused.extend(folder.refused.into_iter().map(|(file, why)| (file, with_cause(why))));
        } else {
            exports.push(read_file(source, &wish)?);
        }
    }
    let staged = StagedFolder::new(&arguments.out, Kind::Tables, arguments.force)?;
    let originals = staged.path().join("originals");
    fs::create_dir(&originals).with_context(|| originals.display().to_string())?;
    let mut names = BTreeSet::new();
    let (mut text, mut files) = (String::new(), Vec::new());
    for export in &exports {
        let name = export.source.file.file_name().context("a file has a name")?.to_string_lossy();
        if !names.insert(name.to_string()) {
            bail!("{name}: given twice, or from two folders: import them one by one");
        }
        fs::write(originals.join(&*name), &export.source.bytes)
            .with_context(|| format!("{name}: can't be written"))?;
        let mut tables = Vec::new();
        for (number, table) in (1..).zip(&export.tables) {
            let file = table_name(&name, table, number, export.tables.len());
            let kept = write_table(&staged.path().join(&file), table)?;
            tables.push(describe(&file, table, &kept));
        }
        text += &export.to_string();
        files.push(json!({
            "original": format!("originals/{name}"),
            "sha256": export.source.sha256,
            "bytes": export.source.bytes.len(),
            "tables": tables,
        }));
    }
    for (file, why) in &refused {
        text += &format!("not read: {}: {why}\n", file.display());
    }
    let json = json!({
        "format": "phantom-import/1",
        "out": arguments.out,
        "files": files,
        "refused": refused.iter().map(|(file, why)| json!({"file": file, "why": why})).collect::<Vec<_>>(),
    });
    let write = |name: &str, text: &str| {
        fs::write(staged.path().join(name), text).with_context(|| format!("{name}: can't be written"))
    };
    write("import.txt", &text)?;
    write("import.json", &format!("{json:#}\n"))?;
    staged.finish()?;
    let contradicted = exports.iter().flat_map(|e| &e.tables).flat_map(|t| &t.findings);
    let contradicted = contradicted.filter(|finding| finding.weight == Weight::Contradiction).count();
    let count: usize = exports.iter().map(|e| e.tables.len()).sum();
    text += &format!("{} in {}", counted(count, "table", "tables"), arguments.out.display());
    if contradicted > 0 {
        text +=
            "\nnote: labels contradict their numbers: say what they are in an override (--as), see --help";
    }
    let good = contradicted == 0 && refused.is_empty();
    Ok(Outcome { exit: if good { Exit::Good } else { Exit::Degraded }, text, json })
}

/// The file's name without its ending, and the specimen where there are several.
fn table_name(file: &str, table: &Table, number: usize, of: usize) -> String {
    let stem = Path::new(file).file_stem().map_or(file.into(), |stem| stem.to_string_lossy());
    if of == 1 {
        return format!("{stem}.csv");
    }
    let plain = |c: char| if c.is_alphanumeric() || "-_ .".contains(c) { c } else { '_' };
    let label: String = table.label.chars().map(plain).collect();
    format!("{stem}-{number}{}{label}.csv", if label.is_empty() { "" } else { "-" })
}

/// Columns that have values in SI.
fn kept(table: &Table) -> Vec<(&Column, Vec<f64>)> {
    table.columns.iter().filter(|c| !c.printed.is_empty()).filter_map(|c| Some((c, c.si()?))).collect()
}

/// Writes a table: names, units, rows; a cell that is empty in the export is empty.
fn write_table<'a>(file: &Path, table: &'a Table) -> anyhow::Result<Vec<&'a Column>> {
    let columns = kept(table);
    let unit = |column: &Column| match &column.unit {
        crate::calib::export::UnitRead::Known(unit, _) => unit.dimension.si(),
        _ => "",
    };
    let cannot = || format!("{}: can't be written", file.display());
    let mut writer = csv::Writer::from_path(file).with_context(cannot)?;
    let lead =
        |first: &str, rest: Vec<String>| std::iter::once(first.to_owned()).chain(rest).collect::<Vec<_>>();
    let names = columns.iter().map(|(c, _)| heading(c)).collect();
    writer.write_record(lead("line", names)).with_context(cannot)?;
    let units = columns.iter().map(|(c, _)| unit(c).to_owned()).collect();
    writer.write_record(lead("1", units)).with_context(cannot)?;
    let mut cells = vec![vec![String::new(); columns.len()]; table.lines.len()];
    for (number, (column, values)) in columns.iter().enumerate() {
        for (row, value) in column.rows.iter().zip(values) {
            cells[*row][number] = format!("{value:?}");
        }
    }
    for (line, row) in table.lines.iter().zip(cells) {
        writer.write_record(lead(&line.to_string(), row)).with_context(cannot)?;
    }
    writer.flush().with_context(cannot)?;
    Ok(columns.into_iter().map(|(column, _)| column).collect())
}

/// What a column holds, with the export's own name for it.
fn heading(column: &Column) -> String {
    match column.quantity {
        Quantity::Other => column.name.clone(),
        quantity if column.extreme => format!("{quantity} extremes ({})", column.name),
        quantity => format!("{quantity} ({})", column.name),
    }
}

fn describe(file: &str, table: &Table, kept: &[&Column]) -> Value {
    let columns = table.columns.iter().map(|column| {
        json!({
            "heading": column.heading,
            "quantity": column.quantity.to_string(),
            "values": column.printed.len(),
            "in_table": kept.iter().any(|k| std::ptr::eq(*k, column)),
        })
    });
    json!({
        "file": file,
        "specimen": table.label,
        "rows": table.lines.len(),
        "loading": table.loading.map(|loading| format!("{loading:?}").to_lowercase()),
        "area_m2": table.specimen.area_m2(),
        "columns": columns.collect::<Vec<_>>(),
        "findings": table.findings.iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}
