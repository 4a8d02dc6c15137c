//! What the sensor's page `netftapi2.xml` says, tag by tag: bytes → the text of each element.
//!
//! The page is flat: a root `<netft>` and one element a value. Arrays are joined by semicolons, commas or spaces (ATI 9620-05 and
//! 9610-05, chapter 11).

use super::super::DriverError;
use quick_xml::Reader;
use quick_xml::errors::{Error, IllFormedError};
use quick_xml::escape::resolve_predefined_entity;
use quick_xml::events::Event;

/// Names of the root in lower case: what sensors send, and what others that speak their protocol do.
const ROOTS: [&str; 3] = ["netft", "netftapi", "netftapi2"];

/// The page's elements with their text, in the order of the page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Page {
    /// Tags in lower case, texts trimmed.
    elements: Vec<(String, String)>,
}

impl Page {
    /// Reads the page up to the end of its root.
    ///
    /// # Errors
    /// [`DriverError::ForcePageBroken`], [`DriverError::ForceOtherPage`].
    pub(super) fn read(bytes: &[u8]) -> Result<Self, DriverError> {
        // Firmware is not always honest about its encoding; whatever is not UTF-8 can only matter in a unit's name, where it is
        // taken for a mark.
        let text = String::from_utf8_lossy(bytes);
        let mut reader = Reader::from_str(&text);
        let mut open: Vec<(String, String)> = Vec::new();
        let mut elements = Vec::new();
        loop {
            let byte = reader.buffer_position();
            let broken = |error: Error| DriverError::ForcePageBroken { byte, why: error.to_string() };
            let event = reader.read_event().map_err(broken)?;
            let ends = matches!(event, Event::Empty(_) | Event::End(_));
            match event {
                Event::Start(tag) | Event::Empty(tag) => {
                    let name = tag.local_name().as_ref().to_lowercase();
                    if open.is_empty() && !ROOTS.contains(&name.as_str()) {
                        return Err(other_page(name));
                    }
                    open.push((name, String::new()));
                }
                Event::Text(text) => append(&mut open, &text.xml10_content()),
                Event::CData(text) => append(&mut open, &text.xml10_content()),
                Event::GeneralRef(entity) => {
                    let resolved = entity.resolve_char_ref().map_err(broken)?.map(String::from);
                    let known = || resolve_predefined_entity(&entity).map(str::to_owned);
                    append(&mut open, &resolved.or_else(known).unwrap_or_else(|| "\u{fffd}".to_owned()));
                }
                Event::Eof => {
                    let Some((name, _)) = open.pop() else { return Err(other_page(String::new())) };
                    return Err(broken(Error::IllFormed(IllFormedError::MissingEndTag(name))));
                }
                _ => {}
            }
            if ends && let Some((name, text)) = open.pop() {
                if open.is_empty() {
                    return Ok(Self { elements });
                }
                elements.push((name, text.trim().to_owned()));
            }
        }
    }

    /// Whether an element of that name is there.
    pub(super) fn has(&self, tag: &str) -> bool {
        self.elements.iter().any(|(name, _)| name == tag)
    }

    /// The text of an element, none when it is not there.
    ///
    /// # Errors
    /// It is there twice with different texts.
    pub(super) fn text(&self, tag: &'static str) -> Result<Option<&str>, DriverError> {
        let mut texts = self.elements.iter().filter(|(name, _)| name == tag).map(|(_, text)| text.as_str());
        let Some(first) = texts.next() else { return Ok(None) };
        match texts.find(|other| *other != first) {
            None => Ok(Some(first)),
            Some(other) => Err(refused(tag, Some(&format!("{first:?} and {other:?}")), "one value")),
        }
    }

    /// The text of an element that stands for one value. When there are several, it is the one of the active configuration.
    ///
    /// # Errors
    /// As [`Page::text`]; several values and no index that says which.
    pub(super) fn scalar(&self, tag: &'static str) -> Result<Option<&str>, DriverError> {
        self.active(tag, items(self.text(tag)?.unwrap_or_default()))
    }

    /// A name that may be there for one configuration or for each. A name may hold spaces.
    ///
    /// # Errors
    /// As [`Page::scalar`].
    pub(super) fn name(&self, tag: &'static str) -> Result<Option<&str>, DriverError> {
        let text = self.text(tag)?.unwrap_or_default();
        self.active(tag, text.split([';', ',']).map(str::trim).filter(|item| !item.is_empty()).collect())
    }

    /// The values of an array, none when the element is not there.
    ///
    /// # Errors
    /// As [`Page::text`].
    pub(super) fn array(&self, tag: &'static str) -> Result<Option<Vec<&str>>, DriverError> {
        Ok(self.text(tag)?.map(items))
    }

    fn active<'a>(&self, tag: &'static str, items: Vec<&'a str>) -> Result<Option<&'a str>, DriverError> {
        if items.len() <= 1 {
            return Ok(items.first().copied());
        }
        let index = self.text("setcfgsel")?.and_then(|index| index.parse::<usize>().ok());
        match index.and_then(|index| items.get(index)) {
            Some(item) => Ok(Some(item)),
            None => Err(refused(
                tag,
                Some(&items.join(" ")),
                "one value, or one a configuration and <setcfgsel> to say which",
            )),
        }
    }
}

/// A setting that readings cannot be built upon.
pub(super) fn refused(tag: &'static str, value: Option<&str>, expected: impl Into<String>) -> DriverError {
    DriverError::ForceSetting { tag, value: value.map(str::to_owned), expected: expected.into() }
}

fn other_page(root: String) -> DriverError {
    DriverError::ForceOtherPage { root, expected: "root element netft of netftapi2.xml" }
}

fn items(text: &str) -> Vec<&str> {
    text.split(|c: char| c == ';' || c == ',' || c.is_whitespace()).filter(|item| !item.is_empty()).collect()
}

fn append(open: &mut [(String, String)], text: &str) {
    if let Some((_, so_far)) = open.last_mut() {
        so_far.push_str(text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(inside: &str) -> Page {
        Page::read(format!("<?xml version=\"1.0\"?><netft>{inside}</netft>\n").as_bytes()).expect("a page")
    }

    #[test]
    fn elements_are_read_whatever_their_dress() {
        let page = page(
            "<!-- c --><CfgCpf a=\"1\"> 10 </CfgCpf><a:cfgcpt xmlns:a=\"u\">2<!-- in between -->0</a:cfgcpt>\
             <cfgnam><![CDATA[a < b]]> &amp; &#99;</cfgnam><scfgtu>N&middot;m</scfgtu><cfgusra/>",
        );
        assert_eq!(page.text("cfgcpf").expect("one"), Some("10"));
        assert_eq!(page.text("cfgcpt").expect("one"), Some("20"));
        assert_eq!(page.text("cfgnam").expect("one"), Some("a < b & c"));
        assert_eq!(page.text("scfgtu").expect("one"), Some("N\u{fffd}m"));
        assert_eq!(page.text("cfgusra").expect("one"), Some(""));
        assert_eq!(page.text("cfgmr").expect("one"), None);
    }

    #[test]
    fn an_element_may_be_repeated_but_not_changed() {
        assert_eq!(page("<cfgcpf>1</cfgcpf><cfgcpf> 1</cfgcpf>").text("cfgcpf").expect("equal"), Some("1"));
        let error =
            page("<cfgcpf>1</cfgcpf><cfgcpf>2</cfgcpf>").text("cfgcpf").expect_err("different").to_string();
        assert!(error.contains("<cfgcpf>") && error.contains("\"1\" and \"2\""), "{error}");
    }

    #[test]
    fn an_array_needs_the_active_index() {
        for separator in [";", ",", " ", "; "] {
            let array = ["10", "20", "30"].join(separator);
            let with = page(&format!("<cfgcpf>{array}</cfgcpf><setcfgsel>2</setcfgsel>"));
            assert_eq!(with.scalar("cfgcpf").expect("indexed"), Some("30"));
            for index in
                ["", "<setcfgsel>3</setcfgsel>", "<setcfgsel>x</setcfgsel>", "<setcfgsel>-1</setcfgsel>"]
            {
                let without = page(&format!("<cfgcpf>{array}</cfgcpf>{index}"));
                let error = without.scalar("cfgcpf").expect_err("no index").to_string();
                assert!(error.contains("cfgcpf") && error.contains("10 20 30"), "{error}");
            }
        }
    }

    #[test]
    fn other_pages_and_torn_pages_are_told_apart() {
        for text in [
            "",
            "no page",
            "<html></html>",
            "<netftCalibration><calcpf>1</calcpf></netftCalibration>",
            "<a/>",
        ] {
            let error = Page::read(text.as_bytes()).expect_err(text);
            assert!(matches!(error, DriverError::ForceOtherPage { .. }), "{text}: {error}");
        }
        let whole = "<netft><cfgcpf>1</cfgcpf><cfgnam>a&amp;b</cfgnam></netft>";
        for length in "<netft>".len()..whole.len() {
            let error = Page::read(&whole.as_bytes()[..length]).expect_err("torn");
            assert!(matches!(error, DriverError::ForcePageBroken { .. }), "{length}: {error}");
        }
        assert!(matches!(Page::read(b"<netft><a></b></netft>"), Err(DriverError::ForcePageBroken { .. })));
    }
}
