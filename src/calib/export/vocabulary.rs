//! The words by which columns are known: English, German, Russian, Chinese.

use super::quantity::Quantity as Q;

/// Words in the order in which they decide: "strain rate" is a rate, "tensile strain (displacement)" a strain. Four letters or fewer
/// stand for a whole word, longer ones may be part of one; so may all that is not ASCII. A dash in front: the end of a word, as German
/// joins them.
pub(super) const WORDS: &[(Q, &[&str])] = &[
    (Q::Other, &["elapsed cycle time", "cycle elapsed time", "cycle time", "step time", "datetime", "date"]),
    (
        Q::Other,
        &[
            "modul",
            "energy",
            "work",
            "arbeit",
            "энерг",
            "модул",
            "模量",
            "能量",
            "poisson",
            "phase",
            "status",
        ],
    ),
    (Q::Other, &["sd", "std", "stdev", "deviation", "标准差", "отклонен"]),
    (Q::Speed, &["speed", "rate", "velocity", "geschwindigkeit", "скорост", "速度", "速率"]),
    (Q::Temperature, &["temp", "temperat", "темпер", "温度"]),
    (
        Q::GaugeLength,
        &[
            "gauge length",
            "gage length",
            "specimen length",
            "original length",
            "initial length",
            "messlänge",
            "messlaenge",
        ],
    ),
    (
        Q::GaugeLength,
        &[
            "einspannlänge",
            "grip separation",
            "grip distance",
            "l0",
            "lo",
            "расчетная длина",
            "начальная длина",
            "标距",
            "试样长度",
        ],
    ),
    (Q::Thickness, &["thickness", "dicke", "толщин", "厚度"]),
    (Q::Width, &["width", "breite", "ширин", "宽度"]),
    (Q::Diameter, &["diameter", "durchmesser", "диаметр", "直径"]),
    (
        Q::Area,
        &[
            "area",
            "cross-section",
            "cross section",
            "crosssection",
            "querschnitt",
            "s0",
            "площад",
            "сечени",
            "面积",
        ],
    ),
    (Q::Cycle, &["cycle", "zyklus", "zyklen", "цикл", "循环"]),
    (Q::Stress, &["stress", "spannung", "напряж", "应力", "σ", "sigma"]),
    (
        Q::Strain,
        &[
            "strain",
            "относительное удлинение",
            "относительная деформация",
            "stauchung",
            "应变",
            "ε",
            "epsilon",
        ],
    ),
    (Q::Time, &["time", "-zeit", "время", "时间", "seconds", "elapsed"]),
    (Q::Force, &["force", "load", "-kraft", "last", "нагрузк", "усили", "сила", "负荷", "载荷", "力"]),
    (Q::Gap, &["gap", "abstand", "зазор", "间隙", "plattenabstand"]),
    (
        Q::Extension,
        &[
            "extension",
            "displacement",
            "displ",
            "disp",
            "position",
            "crosshead",
            "stroke",
            "travel",
            "extn",
            "deflection",
        ],
    ),
    (
        Q::Extension,
        &["-weg", "traverse", "verschiebung", "verlängerung", "längenänderung", "hub", "durchbiegung"],
    ),
    (Q::Extension, &["перемещ", "ход", "травер", "прогиб", "位移", "行程", "横梁", "挠度"]),
    (Q::Specimen, &["specimen", "sample", "probe", "test no", "образец", "试样", "试件"]),
];

/// Words for a length in one export and for a ratio in another; the unit decides.
pub(super) const ELONGATION: &[&str] =
    &["elongation", "deformation", "dehnung", "verformung", "удлинен", "деформац", "伸长", "变形"];

/// Letters of formulas.
pub(super) const LETTERS: &[(Q, &[&str])] = &[
    (Q::Time, &["t"]),
    (Q::Force, &["f", "p", "fz"]),
    (Q::Gap, &["l", "h"]),
    (Q::Extension, &["dl", "δl", "∆l", "u", "d", "s", "x"]),
    (Q::Strain, &["e", "eps"]),
    (Q::Stress, &["sig"]),
];

pub(super) const TRUE: &[&str] = &["true", "wahre", "истин", "真", "logarithmic", "hencky", "cauchy"];

/// Marks of columns that hold a few values of others, not a value a row.
pub(super) const EXTREMES: &[&str] =
    &["p&v", "peak", "valley", "maximum", "minimum", "max", "min", "spitze", "пик", "峰", "最大"];

/// Words of the middle of a sample, which close a table of results.
pub(super) const STATISTICS: &[&str] = &[
    "mean",
    "average",
    "median",
    "sd",
    "std",
    "stdev",
    "standard deviation",
    "cv",
    "cov",
    "range",
    "minimum",
    "maximum",
    "min",
    "max",
    "mittelwert",
    "standardabweichung",
    "среднее",
    "平均",
    "平均值",
    "标准差",
];

pub(super) const EXTENSOMETER: &[&str] = &[
    "extensom",
    "video",
    "ave",
    "dehnungsaufnehmer",
    "feindehnung",
    "экстензом",
    "引伸计",
    "变形",
    "laser",
    "dic",
    "strain gauge",
];
pub(super) const CROSSHEAD: &[&str] = &[
    "crosshead",
    "displacement",
    "travers",
    "grip",
    "einspann",
    "травер",
    "横梁",
    "位移",
    "position",
    "stroke",
];

/// Words of preambles with letters beyond ASCII.
pub(super) const MORE: &[&str] = &[
    "prüf",
    "höchstkraft",
    "länge",
    "образ",
    "испыт",
    "试验",
    "材料",
    "фамил",
    "scherfläche",
    "größe",
    "für",
];
