//! What is asked of a program, and where it and the stock are.

use crate::{
    failure::Failure,
    solid::Origin,
    spec::{ProgramArgs, Travel, UnitsName, ZeroPlace},
    study::workpiece::Workpiece,
    surface::Polish,
};
use glam::{DVec2, DVec3};
use glasswarp_verify::program::{Dynamics, Survey, Tool, Units};
use std::{
    collections::BTreeMap,
    io::{self, BufRead},
};

/// Opens the program from its beginning; it is read more than once, and never held as a whole.
pub type Source<'a> = &'a dyn Fn() -> io::Result<Box<dyn BufRead + 'a>>;

/// Where the program's zero is, if not where the side file has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Zero {
    /// At a place of the block.
    At(Origin),
    /// In the frame of the bench, mm.
    Place(DVec3),
}

/// What is asked of a program.
#[derive(Clone, Debug)]
pub struct ProgramQuestion {
    /// Shapes of tools, by number; `None` for every tool without one of its own.
    pub tools: Vec<(Option<u32>, Tool)>,
    /// Units of a program that names none.
    pub units: Option<Units>,
    /// The program's zero, if the side file's is not meant.
    pub zero: Option<Zero>,
    /// The stock, mm: its size along x and y, its thickness from the entry face up. Each as the
    /// side file has it if it is not given.
    pub stock_mm: (Option<DVec2>, Option<f64>),
    /// How far the machine's axes go, mm.
    pub travel_mm: Option<DVec3>,
    /// What the machine can do.
    pub dynamics: Dynamics,
    /// What is done to the face afterwards.
    pub polish: Option<Polish>,
}

/// Corners of a program that does not say how they are treated are cut by so much at most, mm: what
/// GRBL does unless it is told otherwise.
pub const CORNER_MM: f64 = 0.01;

impl ProgramQuestion {
    /// What is asked by these arguments.
    ///
    /// # Errors
    /// An acceleration that is none, a polish that cannot be.
    pub fn of(args: &ProgramArgs) -> Result<Self, Failure> {
        let dynamics = Dynamics {
            acceleration: args.acceleration.map_or(f64::INFINITY, |length| length.mm),
            rapid_feed: args.rapid.mm_per_minute,
            corner_mm: CORNER_MM,
        };
        if dynamics.acceleration <= 0.0 {
            return Err(Failure::Usage("an acceleration (`acceleration`) must be above 0".into()));
        }
        Ok(Self {
            tools: args.tool.iter().map(|one| (one.number, one.tool)).collect(),
            units: args.units.map(|unit| if unit == UnitsName::In { Units::Inches } else { Units::Millimetres }),
            zero: args.origin.map(|zero| match zero {
                ZeroPlace::Named(name) => Zero::At(name.into()),
                ZeroPlace::At(place) => Zero::Place(DVec3::from(place)),
            }),
            stock_mm: (
                args.stock.and_then(|stock| stock.across_mm).map(DVec2::from),
                args.stock.map(|stock| stock.thickness_mm),
            ),
            travel_mm: args.travel.map(|Travel(travel)| DVec3::from(travel)),
            dynamics,
            polish: args.polish.map(|length| Polish::new(length.mm)).transpose().map_err(Failure::refused)?,
        })
    }
}

/// The place of the stock and of the program, mm in the frame of the bench.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    /// The program's zero.
    pub zero_mm: DVec3,
    /// Least and greatest corner of the stock: from the entry face to its top.
    pub stock_mm: (DVec3, DVec3),
}

/// Where stock and program are.
pub(super) fn setup_of(piece: &Workpiece, question: &ProgramQuestion) -> Result<Setup, Failure> {
    let (frame, entry_z) = (&piece.side.frame, piece.block.entry_z_mm());
    let (low, high) = piece.block.entry_face_mm();
    let (size, thickness) = question.stock_mm;
    let known = |given: f64, found: f64| if given > 0.0 { given } else { found };
    let (_, highest) = piece.block.height_range_mm();
    let highest = highest.max(piece.block.rim_z_mm().unwrap_or(f64::NEG_INFINITY));
    let thickness_mm = thickness.unwrap_or_else(|| known(frame.stock_thickness_mm, highest - entry_z));
    let size_mm = size.unwrap_or_else(|| {
        DVec2::new(known(frame.stock_width_mm, high.x - low.x), known(frame.stock_height_mm, high.y - low.y))
    });
    if !(thickness_mm > 0.0 && size_mm.cmpgt(DVec2::ZERO).all()) {
        return Err(Failure::Usage(format!(
            "the stock (`stock`) is {} x {} x {thickness_mm} mm: every side must be longer than 0",
            size_mm.x, size_mm.y
        )));
    }
    let half = 0.5 * size_mm;
    let top = entry_z + thickness_mm;
    let zero_mm = match question.zero {
        None => frame.origin_mm(),
        Some(Zero::Place(place)) => place,
        Some(Zero::At(origin)) => match origin {
            Origin::Exit => DVec3::ZERO,
            Origin::Entry => DVec3::new(0.0, 0.0, entry_z),
            Origin::StockTop => DVec3::new(0.0, 0.0, top),
            Origin::Corner => (-half).extend(entry_z),
        },
    };
    Ok(Setup { zero_mm, stock_mm: ((-half).extend(entry_z), half.extend(top)) })
}

/// The shape of every tool that feeds.
pub(super) fn shapes(
    survey: &Survey,
    question: &ProgramQuestion,
    setup: &Setup,
) -> Result<BTreeMap<u32, Tool>, Failure> {
    let given = |number: Option<u32>| question.tools.iter().find(|(of, _)| *of == number).map(|(_, tool)| *tool);
    let size = setup.stock_mm.1 - setup.stock_mm.0;
    let mut tools = BTreeMap::new();
    for (&number, used) in survey.tools.iter().filter(|(_, used)| used.is_used) {
        let shape = given(Some(number)).or_else(|| given(None)).or(used.shape).or(survey.unnumbered);
        let Some(shape) = shape else {
            let which = if number == 0 { String::new() } else { format!("{number}=") };
            return Err(Failure::Usage(format!(
                "nobody says what tool {number} of the program looks like: name it, as in `tool` {which}ball:d6mm"
            )));
        };
        let across = 2.0 * shape.radius_mm;
        if across > size.x.min(size.y) {
            return Err(Failure::Usage(format!(
                "tool {number} ({shape}) is {across} mm across, more than the stock of {} x {} mm: is a radius meant (ball:r3mm), \
                 or another stock (`stock`)?",
                size.x, size.y
            )));
        }
        tools.insert(number, shape);
    }
    if tools.is_empty() {
        return Err(Failure::Unreadable("the program feeds nothing: all of its moves are rapids".into()));
    }
    Ok(tools)
}
