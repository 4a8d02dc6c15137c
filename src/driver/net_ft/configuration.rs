//! What the sensor's counts are worth and how fast they come: the active configuration of `netftapi2.xml`, checked.
//!
//! Only `cfgcpf`, `cfgcpt` and the units beside them belong to the stream. The page `netftcalapi.xml` has counts of its own
//! (`calcpf`, `calcpt`), those of the calibration: they differ whenever the active configuration uses other units, and are never read.

use super::super::DriverError;
use super::page::{Page, refused};
use super::rdt::MOST_RECORDS;
use super::status::NetFtProduct;
use super::units::{self, Unit};
use crate::device::ForceFormat;

/// Internal rate of a Net Box (1/s): ATI 9620-05, chapter 10.
const NET_BOX_TICK_HZ: f64 = 7000.0;

/// What the sensor says of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct NetFtConfiguration {
    /// Family of the sensor.
    pub product: NetFtProduct,
    /// Product name, as it says; empty when it says none.
    pub product_name: String,
    /// Serial number of the calibration in use; empty when it says none.
    pub calibration: String,
    /// Name of the configuration in use; empty when it says none.
    pub name: String,
    /// Counts for 1 N.
    pub counts_per_newton: f64,
    /// Counts for 1 N·m.
    pub counts_per_newton_metre: f64,
    /// Records a second.
    pub rate_hz: f64,
    /// Internal rate (1/s).
    pub tick_hz: f64,
    /// Records a datagram of the buffered mode, where it says so.
    pub records_a_datagram: Option<usize>,
    /// Largest wrench of the calibration, where it says so (N and N·m).
    pub range: Option<[f64; 6]>,
    /// Status word at the time of asking, where it says so.
    pub status: Option<u32>,
}

impl NetFtConfiguration {
    /// Reads the page `netftapi2.xml`.
    ///
    /// # Errors
    /// [`DriverError`]: no XML, another page, or a setting that readings cannot be built upon: missing or contradicting units,
    /// counts or rates that are no positive numbers, RDT switched off.
    pub fn parse(xml: &[u8]) -> Result<Self, DriverError> {
        let page = Page::read(xml)?;
        let force =
            unit(&page, "scfgfu", "cfgfu", &units::FORCE, "a unit of force: lbf, N, klbf, kN, kgf, gf")?;
        let torque = unit(
            &page,
            "scfgtu",
            "cfgtu",
            &units::TORQUE,
            "a unit of torque: lbf-in, lbf-ft, Nm, Nmm, kgf-cm, kNm",
        )?;
        let counts_per_newton = positive(&page, "cfgcpf", "counts per unit of force")? / force.si;
        let counts_per_newton_metre = positive(&page, "cfgcpt", "counts per unit of torque")? / torque.si;
        if let Some(off @ ("Disabled" | "0")) = page.scalar("comrdte")? {
            return Err(refused(
                "comrdte",
                Some(off),
                "Enabled: switch RDT on, on the sensor's page Communications",
            ));
        }
        let product_name = page.text("prodname")?.unwrap_or_default().to_owned();
        let product = product(&page, &product_name);
        let tick_hz = match page.has("runrate") {
            false if product == NetFtProduct::NetBox => NET_BOX_TICK_HZ,
            _ => positive(&page, "runrate", "the sensor's internal rate (1/s)")?,
        };
        // Older and newer firmware spell the tag differently.
        let tag = if page.has("comrdtrate") { "comrdtrate" } else { "commrdtrate" };
        let rate_hz = positive(&page, tag, "records a second")?;
        if rate_hz > tick_hz {
            let value = rate_hz.to_string();
            return Err(refused(tag, Some(&value), format!("at most the internal rate of {tick_hz}/s")));
        }
        Ok(Self {
            product,
            product_name,
            calibration: page.name("cfgcalsn")?.unwrap_or_default().to_owned(),
            name: page.text("cfgnam")?.unwrap_or_default().to_owned(),
            counts_per_newton,
            counts_per_newton_metre,
            rate_hz,
            tick_hz,
            records_a_datagram: records_a_datagram(&page)?,
            range: range(&page, force.si, torque.si)?,
            status: status(&page)?,
        })
    }

    /// What the records of its stream mean.
    pub fn format(&self) -> ForceFormat {
        ForceFormat {
            counts_per_newton: self.counts_per_newton,
            counts_per_newton_metre: self.counts_per_newton_metre,
            rate_hz: self.rate_hz,
            tick_hz: self.tick_hz,
            range: self.range,
            stop_mask: self.product.stop_mask(),
        }
    }
}

/// The unit that name and code agree upon; either alone will do.
fn unit(
    page: &Page,
    name_tag: &'static str,
    code_tag: &'static str,
    known: &[Unit],
    expected: &'static str,
) -> Result<Unit, DriverError> {
    let (name, code) = (page.name(name_tag)?, page.scalar(code_tag)?);
    let named =
        name.map(|n| units::named(known, n).ok_or_else(|| refused(name_tag, name, expected))).transpose()?;
    let coded = code
        .map(|c| units::coded(known, c).ok_or_else(|| refused(code_tag, code, format!("1 to 6, {expected}"))))
        .transpose()?;
    match (named, coded) {
        (Some(named), Some(coded)) if named != coded => {
            let contradiction = format!("unit {} as <{code_tag}> says", coded.code);
            Err(refused(name_tag, name, contradiction))
        }
        (Some(unit), _) | (None, Some(unit)) => Ok(unit),
        (None, None) => Err(refused(name_tag, None, expected)),
    }
}

fn positive(page: &Page, tag: &'static str, what: &str) -> Result<f64, DriverError> {
    let text = page.scalar(tag)?;
    text.and_then(|t| t.parse().ok())
        .filter(|value: &f64| value.is_finite() && *value > 0.0)
        .ok_or_else(|| refused(tag, text, format!("{what}, a positive number")))
}

fn records_a_datagram(page: &Page) -> Result<Option<usize>, DriverError> {
    let Some(text) = page.scalar("comrdtbsiz")? else { return Ok(None) };
    let size = text.parse().ok().filter(|size| (1..=MOST_RECORDS).contains(size));
    size.map(Some)
        .ok_or_else(|| refused("comrdtbsiz", Some(text), format!("1 to {MOST_RECORDS} records a datagram")))
}

/// The calibrated range in the units of the configuration; zeros say that it is not known.
fn range(page: &Page, force: f64, torque: f64) -> Result<Option<[f64; 6]>, DriverError> {
    let Some(items) = page.array("cfgmr")? else { return Ok(None) };
    let values: Vec<f64> =
        items.iter().filter_map(|t| t.parse().ok()).filter(|v: &f64| v.is_finite() && *v >= 0.0).collect();
    let range = <[f64; 6]>::try_from(values).ok().filter(|_| items.len() == 6);
    let Some(range) = range else {
        return Err(refused("cfgmr", Some(&items.join(" ")), "six ranges, none of them negative"));
    };
    let si = std::array::from_fn(|i| range[i] * if i < 3 { force } else { torque });
    Ok(range.iter().all(|v| *v > 0.0).then_some(si))
}

fn status(page: &Page) -> Result<Option<u32>, DriverError> {
    let Some(text) = page.scalar("runstat")? else { return Ok(None) };
    let digits = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X"));
    let word = digits.and_then(|d| u32::from_str_radix(d, 16).ok());
    word.map(Some).ok_or_else(|| refused("runstat", Some(text), "a status word such as 0x00000000"))
}

/// By its name, or else by the settings that only one family has.
fn product(page: &Page, name: &str) -> NetFtProduct {
    let name: String = name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
    if name.contains("axia") {
        NetFtProduct::Axia
    } else if name.contains("netbox") || name.contains("netft") {
        NetFtProduct::NetBox
    } else if ["setiirshift", "setadcrate", "runmtx"].iter().any(|tag| page.has(tag)) {
        NetFtProduct::Axia
    } else if ["setuserfilter", "setcfgsel", "setpke"].iter().any(|tag| page.has(tag)) {
        NetFtProduct::NetBox
    } else {
        NetFtProduct::Unknown
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tags that a Net Box with a Gamma SI-330-30 and firmware 2.2.59 was reported to send, shortened.
    const NET_BOX: &str = "<?xml version=\"1.0\"?><netft>\
        <runstat>0x80010000</runstat><runrate>7000</runrate><runpkmx>15186840;15450145;20557075;1367250;2491043;1854244</runpkmx>\
        <cfgnam>gel bench, low</cfgnam><cfgcalsel>0</cfgcalsel><cfgcalsn>FT27462</cfgcalsn>\
        <scfgfu>N</scfgfu><scfgtu>Nm</scfgtu><cfgtfx>0;0;132.710;0;0;0</cfgtfx><scfgtdu>mm</scfgtdu>\
        <cfgcpf>1000000</cfgcpf><cfgcpt>500000</cfgcpt><cfgmr>330;330;990;30;30;30</cfgmr>\
        <setcfgsel>0</setcfgsel><setpke>1</setpke><setbias>745;17;447;184;-596;-253</setbias>\
        <setuserfilter>0</setuserfilter><comrdte>Enabled</comrdte><comrdtrate>1000</comrdtrate><comrdtbsiz>10</comrdtbsiz>\
        <mfgdigver>2.2.59</mfgdigver></netft>";

    fn with(from: &str, to: &str) -> Result<NetFtConfiguration, DriverError> {
        assert!(NET_BOX.contains(from), "{from}");
        NetFtConfiguration::parse(NET_BOX.replace(from, to).as_bytes())
    }

    #[test]
    fn a_net_box_is_read() {
        let read = NetFtConfiguration::parse(NET_BOX.as_bytes()).expect("a page");
        let expected = NetFtConfiguration {
            product: NetFtProduct::NetBox,
            product_name: String::new(),
            calibration: "FT27462".to_owned(),
            name: "gel bench, low".to_owned(),
            counts_per_newton: 1e6,
            counts_per_newton_metre: 5e5,
            rate_hz: 1000.0,
            tick_hz: 7000.0,
            records_a_datagram: Some(10),
            range: Some([330.0, 330.0, 990.0, 30.0, 30.0, 30.0]),
            status: Some(0x8001_0000),
        };
        assert_eq!(read, expected);
    }

    /// An Axia spells the rate with two m and names neither itself nor a configuration.
    #[test]
    fn an_axia_is_read() {
        let page = "<netft><runstat>0x00000000</runstat><setrate>7912</setrate><setiirshift>0</setiirshift>\
            <cfgcalsn>FT54714</cfgcalsn><cfgfu>2</cfgfu><scfgfu>N</scfgfu><cfgtu>3</cfgtu><scfgtu>Nm</scfgtu>\
            <cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt><commrdtrate>1000</commrdtrate><comrdtbsiz>10</comrdtbsiz>\
            <runrate>7912</runrate></netft>";
        let read = NetFtConfiguration::parse(page.as_bytes()).expect("a page");
        assert_eq!((read.product, read.rate_hz, read.tick_hz), (NetFtProduct::Axia, 1000.0, 7912.0));
        assert_eq!((read.name.as_str(), read.range), ("", None));
        // Without its internal rate nobody knows how its clock runs; a Net Box has but one.
        let error = NetFtConfiguration::parse(page.replace("<runrate>7912</runrate>", "").as_bytes());
        assert!(error.expect_err("no clock").to_string().contains("<runrate>"));
        assert_eq!(with("<runrate>7000</runrate>", "").expect("a Net Box").tick_hz, 7000.0);
    }

    #[test]
    fn a_product_is_known_by_its_name_first() {
        for (name, product) in [
            ("Ethernet Axia", NetFtProduct::Axia),
            ("AXIA80-M20", NetFtProduct::Axia),
            ("Net F/T", NetFtProduct::NetBox),
            ("NET BOX", NetFtProduct::NetBox),
            ("Ethernet thing", NetFtProduct::NetBox),
        ] {
            let read = with("<runstat>", &format!("<prodname>{name}</prodname><runstat>")).expect("a page");
            assert_eq!((read.product, read.product_name.as_str()), (product, name));
        }
        let bare = "<netft><scfgfu>N</scfgfu><scfgtu>Nm</scfgtu><cfgcpf>1</cfgcpf><cfgcpt>1</cfgcpt>\
            <runrate>7000</runrate><comrdtrate>7000</comrdtrate></netft>";
        assert_eq!(
            NetFtConfiguration::parse(bare.as_bytes()).expect("a page").product,
            NetFtProduct::Unknown
        );
    }

    /// 1 unit is so many newtons, hence counts per newton are counts per unit over that.
    #[test]
    fn counts_follow_the_units_in_every_spelling() {
        for (force, newtons, torque, newton_metres) in [
            ("lbf", 4.448_221_615_260_5, "lbf-in", 0.112_984_829_027_616_7),
            ("N", 1.0, "N-mm", 1e-3),
            ("klbf", 4_448.221_615_260_5, "lbf-ft", 1.355_817_948_331_400_4),
            ("kN", 1e3, "kN-m", 1e3),
            ("kgf", 9.806_65, "kg-cm", 0.098_066_5),
            ("gf", 0.009_806_65, "N·m", 1.0),
        ] {
            let units = format!("<scfgfu>{force}</scfgfu><scfgtu>{torque}</scfgtu>");
            let read = with("<scfgfu>N</scfgfu><scfgtu>Nm</scfgtu>", &units).expect("known units");
            assert!((read.counts_per_newton * newtons / 1e6 - 1.0).abs() < 1e-14, "{force}");
            assert!((read.counts_per_newton_metre * newton_metres / 5e5 - 1.0).abs() < 1e-14, "{torque}");
            let range = read.range.expect("ratings");
            assert!((range[2] / newtons / 990.0 - 1.0).abs() < 1e-14, "{force}");
            assert!((range[5] / newton_metres / 30.0 - 1.0).abs() < 1e-14, "{torque}");
        }
        let coded = with("<scfgfu>N</scfgfu>", "<cfgfu>4</cfgfu>").expect("a code alone");
        assert_eq!(coded.counts_per_newton, 1e3);
    }

    #[test]
    fn a_latin_dot_between_the_units_is_a_mark() {
        let mut bytes = NET_BOX.as_bytes().to_vec();
        let at = NET_BOX.find("Nm</scfgtu>").expect("the unit") + 1;
        bytes.insert(at, 0xb7);
        assert_eq!(NetFtConfiguration::parse(&bytes).expect("a unit").counts_per_newton_metre, 5e5);
    }

    /// Each refusal names the tag, what it holds and what was expected.
    #[test]
    fn what_readings_cannot_be_built_upon_is_refused() {
        for (from, to, tag, value, expected) in [
            ("<scfgfu>N</scfgfu>", "", "scfgfu", "missing", "a unit of force"),
            ("<scfgfu>N</scfgfu>", "<scfgfu></scfgfu>", "scfgfu", "missing", "a unit of force"),
            ("<scfgfu>N</scfgfu>", "<scfgfu>stone</scfgfu>", "scfgfu", "stone", "a unit of force"),
            ("<scfgfu>N</scfgfu>", "<scfgfu>N</scfgfu><cfgfu>1</cfgfu>", "scfgfu", "N", "unit 1"),
            ("<scfgfu>N</scfgfu>", "<scfgfu>N</scfgfu><cfgfu>9</cfgfu>", "cfgfu", "9", "1 to 6"),
            ("<scfgtu>Nm</scfgtu>", "<scfgtu>N</scfgtu>", "scfgtu", "N", "a unit of torque"),
            ("<scfgtu>Nm</scfgtu>", "<scfgtu>Nmm</scfgtu><cfgtu>3</cfgtu>", "scfgtu", "Nmm", "unit 3"),
            ("<cfgcpf>1000000</cfgcpf>", "", "cfgcpf", "missing", "positive"),
            ("<cfgcpf>1000000</cfgcpf>", "<calcpf>1000000</calcpf>", "cfgcpf", "missing", "positive"),
            ("<cfgcpf>1000000</cfgcpf>", "<cfgcpf>0</cfgcpf>", "cfgcpf", "0", "positive"),
            ("<cfgcpf>1000000</cfgcpf>", "<cfgcpf>-5</cfgcpf>", "cfgcpf", "-5", "positive"),
            ("<cfgcpf>1000000</cfgcpf>", "<cfgcpf>NaN</cfgcpf>", "cfgcpf", "NaN", "positive"),
            ("<cfgcpf>1000000</cfgcpf>", "<cfgcpf>inf</cfgcpf>", "cfgcpf", "inf", "positive"),
            ("<cfgcpt>500000</cfgcpt>", "<cfgcpt>many</cfgcpt>", "cfgcpt", "many", "positive"),
            ("<setuserfilter>", "<cfgcpf>2000</cfgcpf><setuserfilter>", "cfgcpf", "2000", "one value"),
            ("<setcfgsel>0", "<scfgfu>kN</scfgfu><setcfgsel>0", "scfgfu", "kN", "one value"),
            ("<setcfgsel>0</setcfgsel><setpke>", "<cfgfu>2;1</cfgfu><setpke>", "cfgfu", "2 1", "setcfgsel"),
            ("<comrdtrate>1000", "<comrdtrate>0", "comrdtrate", "0", "records a second"),
            ("<comrdtrate>1000", "<comrdtrate>8000", "comrdtrate", "8000", "7000"),
            ("<comrdtrate>1000</comrdtrate>", "", "comrdtrate", "missing", "records a second"),
            ("<comrdtbsiz>10", "<comrdtbsiz>41", "comrdtbsiz", "41", "1 to 40"),
            ("<comrdte>Enabled", "<comrdte>Disabled", "comrdte", "Disabled", "Enabled"),
            ("<runstat>0x80010000", "<runstat>fine", "runstat", "fine", "status word"),
            ("<cfgmr>330;", "<cfgmr>", "cfgmr", "990", "six"),
            ("<cfgmr>330;", "<cfgmr>-330;", "cfgmr", "-330", "six"),
        ] {
            let error = with(from, to).expect_err(to).to_string();
            let named = error.contains(&format!("<{tag}>"))
                || (tag == "comrdtrate" && error.contains("<commrdtrate>"));
            assert!(named && error.contains(value) && error.contains(expected), "{to}: {error}");
        }
    }

    #[test]
    fn the_page_of_the_calibration_is_not_taken_for_this_one() {
        let page = "<netftCalibration><calsn>FT1</calsn><calcpf>1000000</calcpf><calcpt>1000000</calcpt>\
            <scalfu>N</scalfu><scaltu>Nm</scaltu></netftCalibration>";
        let error = NetFtConfiguration::parse(page.as_bytes()).expect_err("another page").to_string();
        assert!(error.contains("netftcalibration") && error.contains("netftapi2.xml"), "{error}");
    }

    #[test]
    fn ratings_of_zero_are_not_known() {
        assert_eq!(with("330;330;990;30;30;30", "0;0;0;0;0;0").expect("a page").range, None);
    }
}
