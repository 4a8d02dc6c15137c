//! What the emulated sensor's web server answers.

use super::faults::NetFtPageFault;
use super::setup::{NetFtFamily, NetFtSetup};
use quick_xml::escape::escape;

/// The whole answer to the first line of a request.
pub(super) fn answer(request_line: &str, setup: &NetFtSetup, status: u32, fault: NetFtPageFault) -> String {
    let path = request_line.split_whitespace().nth(1).unwrap_or_default();
    let (code, body) = match (path.split('?').next().unwrap_or_default(), fault) {
        (_, NetFtPageFault::Unavailable) => ("500 Internal Server Error", String::new()),
        ("/netftcalapi.xml", _) | ("/netftapi2.xml", NetFtPageFault::CalibrationPage) => {
            ("200 OK", calibration(setup))
        }
        ("/netftapi2.xml", fault) => ("200 OK", configuration(setup, status, fault)),
        _ => ("404 Not Found", String::new()),
    };
    format!(
        "HTTP/1.1 {code}\r\nContent-Type: text/xml\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}",
        body.len()
    )
}

/// The page of the active configuration: tags of ATI 9620-05 and 9610-05, chapter 11.
fn configuration(setup: &NetFtSetup, status: u32, fault: NetFtPageFault) -> String {
    let force = &setup.force_unit;
    let name = match fault {
        NetFtPageFault::UnitsContradict if force.code == 1 => "N",
        NetFtPageFault::UnitsContradict => "lbf",
        _ => &force.name,
    };
    let range: Vec<String> = setup
        .range
        .iter()
        .enumerate()
        .map(|(i, si)| (si / if i < 3 { force.si } else { setup.torque_unit.si }).to_string())
        .collect();
    let rate = (setup.tick_hz / setup.ticks_a_record() as f64).floor().max(1.0);
    let mut values = vec![
        ("runstat", format!("0x{status:08x}")),
        ("runrate", setup.tick_hz.to_string()),
        ("cfgcalsn", setup.calibration.clone()),
        ("cfgfu", force.code.to_string()),
        ("scfgfu", name.to_owned()),
        ("cfgtu", setup.torque_unit.code.to_string()),
        ("scfgtu", setup.torque_unit.name.clone()),
        ("cfgcpf", setup.counts_per_force.to_string()),
        ("cfgcpt", setup.counts_per_torque.to_string()),
        ("cfgmr", range.join(";")),
        ("comrdtbsiz", setup.records_a_datagram.to_string()),
    ];
    if !setup.product.is_empty() {
        values.push(("prodname", setup.product.clone()));
    }
    match setup.family {
        NetFtFamily::NetBox => values.extend([
            ("cfgnam", setup.configuration.clone()),
            ("setcfgsel", "0".to_owned()),
            ("setuserfilter", "0".to_owned()),
            ("comrdte", "Enabled".to_owned()),
            ("comrdtrate", rate.to_string()),
        ]),
        NetFtFamily::Axia => {
            values.extend([("setiirshift", "0".to_owned()), ("commrdtrate", rate.to_string())])
        }
    }
    document("netft", &values)
}

/// The page of the calibration. Its counts are another unit's, as they may be in life.
fn calibration(setup: &NetFtSetup) -> String {
    let values = [
        ("calsn", setup.calibration.clone()),
        ("calfu", "1".to_owned()),
        ("scalfu", "lbf".to_owned()),
        ("caltu", "1".to_owned()),
        ("scaltu", "lbf-in".to_owned()),
        ("calcpf", "4448222".to_owned()),
        ("calcpt", "112985".to_owned()),
    ];
    document("netftCalibration", &values)
}

fn document(root: &str, values: &[(&str, String)]) -> String {
    let inside: String =
        values.iter().map(|(tag, value)| format!("<{tag}>{}</{tag}>\n", escape(value))).collect();
    format!("<?xml version=\"1.0\"?>\n<{root}>\n{inside}</{root}>\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_page_and_fault_has_its_answer() {
        let setup = NetFtSetup { calibration: "a<b".to_owned(), ..NetFtSetup::default() };
        let get = |line: &str, fault| answer(line, &setup, 0x8001_0000, fault);
        let page = get("GET /netftapi2.xml?index=0 HTTP/1.1", NetFtPageFault::None);
        for part in [
            "HTTP/1.1 200 OK",
            "<scfgfu>N<",
            "<cfgfu>2<",
            "<cfgcpf>1000000<",
            "<runstat>0x80010000<",
            "a&lt;b",
            "<comrdtrate>7000<",
        ] {
            assert!(page.contains(part), "{part}: {page}");
        }
        assert!(get("GET /netftapi2.xml HTTP/1.1", NetFtPageFault::UnitsContradict).contains("<scfgfu>lbf<"));
        for calibration in [
            get("GET /netftapi2.xml HTTP/1.1", NetFtPageFault::CalibrationPage),
            get("GET /netftcalapi.xml HTTP/1.1", NetFtPageFault::None),
        ] {
            assert!(calibration.contains("<calcpf>") && !calibration.contains("<cfgcpf>"), "{calibration}");
        }
        assert!(get("GET /netftapi2.xml HTTP/1.1", NetFtPageFault::Unavailable).starts_with("HTTP/1.1 500"));
        assert!(get("GET /comm.cgi?comrdtrate=1 HTTP/1.1", NetFtPageFault::None).starts_with("HTTP/1.1 404"));
        assert!(get("", NetFtPageFault::None).starts_with("HTTP/1.1 404"));
        let length = page.split("Content-Length: ").nth(1).and_then(|rest| rest.split("\r\n").next());
        let body = page.split("\r\n\r\n").nth(1).expect("a body");
        assert_eq!(length.and_then(|l| l.parse().ok()), Some(body.len()));
    }

    #[test]
    fn an_axia_spells_its_rate_otherwise() {
        let setup = NetFtSetup { family: NetFtFamily::Axia, product: String::new(), ..NetFtSetup::default() };
        let page = answer("GET /netftapi2.xml HTTP/1.1", &setup, 0, NetFtPageFault::None);
        assert!(
            page.contains("<commrdtrate>7000<")
                && !page.contains("<comrdtrate>")
                && !page.contains("prodname")
        );
    }
}
