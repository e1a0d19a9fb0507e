//! One model within a 3MF package: its objects, and what it builds of them.

use super::fault::malformed;
use crate::load::error::LoadError;
use glam::{DAffine3, DVec3};
use quick_xml::{
    Reader,
    events::{BytesStart, Event},
};
use std::{
    collections::{BTreeMap, HashSet},
    io::BufRead,
};

/// What a model says.
#[derive(Default)]
pub(super) struct ModelPart {
    /// Millimetres in its unit; 0 without a model.
    pub(super) unit_mm: f64,
    pub(super) objects: BTreeMap<u64, Object>,
    items: Vec<Use>,
    /// The one that is being read.
    current: Option<u64>,
    /// Of the names of the format itself.
    prefix: Option<String>,
}

/// A mesh, or what is put together from others.
#[derive(Default)]
pub(super) struct Object {
    /// In the unit of the part.
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) components: Vec<Use>,
    /// Whether it only holds others up while they are printed.
    pub(super) is_support: bool,
}

/// An object in a place.
#[derive(Clone)]
pub(super) struct Use {
    /// The part that holds the object, if it is another one.
    path: Option<String>,
    pub(super) object: u64,
    /// In the unit of the part that says so.
    transform: DAffine3,
}

impl Use {
    fn of(element: &BytesStart<'_>) -> Result<Self, LoadError> {
        let number = attribute(element, "objectid")?.and_then(|number| number.trim().parse().ok());
        let transform = attribute(element, "transform")?.map_or(Ok(DAffine3::IDENTITY), |text| transform(&text))?;
        Ok(Self {
            path: attribute(element, "path")?.map(|path| path.trim_start_matches('/').to_owned()),
            object: number.ok_or_else(|| malformed("an item or component names no object"))?,
            transform,
        })
    }

    /// The part that holds the object, used in this one.
    pub(super) fn path_or(&self, here: &str) -> String {
        self.path.clone().unwrap_or_else(|| here.to_owned())
    }

    /// Its transformation in millimetres.
    pub(super) fn placed(&self, unit_mm: f64) -> DAffine3 {
        DAffine3 { translation: unit_mm * self.transform.translation, ..self.transform }
    }
}

/// Twelve numbers: three rows, by which a row of coordinates is multiplied from the left, and a
/// translation.
fn transform(text: &str) -> Result<DAffine3, LoadError> {
    let numbers: Option<Vec<f64>> = text.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
    let numbers: Option<[f64; 12]> = numbers.and_then(|numbers| numbers.try_into().ok());
    let numbers = numbers.filter(|numbers| numbers.iter().all(|number| number.is_finite()));
    let numbers = numbers.ok_or_else(|| malformed(format!("'{text}' is no transformation of twelve numbers")))?;
    Ok(DAffine3::from_cols_array(&numbers))
}

impl ModelPart {
    /// What is built, or all objects that are no part of others if nothing is.
    pub(super) fn built(&self) -> Vec<Use> {
        if !self.items.is_empty() {
            return self.items.clone();
        }
        let used: HashSet<u64> = self
            .objects
            .values()
            .flat_map(|object| &object.components)
            .filter(|component| component.path.is_none())
            .map(|component| component.object)
            .collect();
        let alone = self.objects.keys().copied().filter(|number| !used.contains(number));
        alone.map(|object| Use { path: None, object, transform: DAffine3::IDENTITY }).collect()
    }

    pub(super) fn take(&mut self, element: &BytesStart<'_>) -> Result<(), LoadError> {
        let name = element.local_name();
        let prefix = element.name().prefix().map(|prefix| prefix.as_ref().to_owned());
        if name.as_ref() == "model" && self.unit_mm == 0.0 {
            self.prefix = prefix;
            self.unit_mm = match attribute(element, "unit")?.as_deref() {
                None | Some("millimeter") => 1.0,
                Some("micron") => 1e-3,
                Some("centimeter") => 10.0,
                Some("inch") => 25.4,
                Some("foot") => 304.8,
                Some("meter") => 1000.0,
                Some(other) => return Err(malformed(format!("'{other}' is no unit of 3MF"))),
            };
            return Ok(());
        }
        if prefix != self.prefix {
            return Ok(()); // Of an extension: slices, colours, lattices.
        }
        match name.as_ref() {
            "object" => {
                let number = attribute(element, "id")?.and_then(|number| number.trim().parse().ok());
                let number = number.ok_or_else(|| malformed("an object has no number"))?;
                let kind = attribute(element, "type")?;
                let is_support = matches!(kind.as_deref(), Some("support" | "solidsupport"));
                if self.objects.insert(number, Object { is_support, ..Object::default() }).is_some() {
                    return Err(malformed(format!("two objects have the number {number}")));
                }
                self.current = Some(number);
            }
            "item" => self.items.push(Use::of(element)?),
            "component" => self.object("component")?.components.push(Use::of(element)?),
            "vertex" => {
                let [x, y, z] = values(element, ["x", "y", "z"])?;
                self.object("vertex")?.positions.push(DVec3::new(x, y, z));
            }
            "triangle" => {
                let corners = values(element, ["v1", "v2", "v3"])?;
                self.object("triangle")?.triangles.push(corners);
            }
            _ => {}
        }
        Ok(())
    }

    fn object(&mut self, what: &str) -> Result<&mut Object, LoadError> {
        let current = self.current.and_then(|number| self.objects.get_mut(&number));
        current.ok_or_else(|| malformed(format!("a {what} stands outside of any object")))
    }
}

pub(super) fn each_element(
    source: impl BufRead,
    mut take: impl FnMut(&BytesStart<'_>) -> Result<(), LoadError>,
) -> Result<(), LoadError> {
    let mut reader = Reader::from_reader(source);
    let mut buffer = Vec::new();
    let mut depth = 0_i64;
    loop {
        buffer.clear();
        match reader.read_event_into(&mut buffer).map_err(|error| malformed(error.to_string()))? {
            Event::Start(element) => {
                depth += 1;
                take(&element)?;
            }
            Event::Empty(element) => take(&element)?,
            Event::End(_) => depth -= 1,
            Event::Eof if depth == 0 => return Ok(()),
            Event::Eof => return Err(malformed("its XML ends too early")),
            _ => {}
        }
    }
}

/// An attribute of this name, with whatever prefix.
pub(super) fn attribute(element: &BytesStart<'_>, name: &str) -> Result<Option<String>, LoadError> {
    for attribute in element.attributes() {
        let attribute = attribute.map_err(|error| malformed(error.to_string()))?;
        if attribute.key.local_name().as_ref() == name {
            return Ok(Some(attribute.value.into_owned()));
        }
    }
    Ok(None)
}

/// Three attributes of an element.
fn values<T: std::str::FromStr>(element: &BytesStart<'_>, names: [&str; 3]) -> Result<[T; 3], LoadError> {
    let mut found = [None, None, None];
    for attribute in element.attributes() {
        let attribute = attribute.map_err(|error| malformed(error.to_string()))?;
        if let Some(k) = names.iter().position(|name| *name == attribute.key.as_ref()) {
            found[k] = attribute.value.trim().parse().ok();
        }
    }
    match found {
        [Some(a), Some(b), Some(c)] => Ok([a, b, c]),
        _ => Err(malformed(format!("an element '{}' has not its three numbers", element.name().as_ref()))),
    }
}
