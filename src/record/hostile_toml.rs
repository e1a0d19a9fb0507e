//! TOML files and words of the command line that are damaged at random: refused or understood,
//! never more than that.

#[allow(clippy::print_stderr)]
#[path = "../../tests/common/fuzz.rs"]
mod fuzz;

use crate::{
    fabricate::{Cutter, Direction},
    record::SideFile,
    spec::{self, CutterList, Emission, FinishPlan, Inclination, Length, Range, RimSize, Shift, layers},
};
use fuzz::{Read, Target, cases};
use std::path::Path;

const DESIGN: &str = "# comment\n[design]\npicture = \"a.png\"\npreset = \"desk-demo\"\nsize = \"20cm\"\ndistance = 250\nwindow = 80.5\n\
    shift = \"25mm,-3mm\"\nreceiver-tilt = \"20deg,90deg\"\nmirror = false\nlight = \"point\"\ntilt = \"30deg\"\n\
    source-distance = \"1m\"\nemission = \"gaussian:12deg\"\nior = 1.6\nthickness = 12\nmin-thickness = \"3mm\"\nskirt = 1\nnodes = 257\n\
    rim = \"10mm,-4mm\"\nmark = 5\norigin = \"stock-top\"\nstep-tolerance = 0.5\noffset = 0.1\ntransfer = 'srgb'\n\
    crop = '1,2,30,40'\nrotate = '90deg'\nflip = 'vertical'\nlevels = '0.1,0.9,1.2'\ninvert = true\nbackground = '#102030'\nlayer = 'a.b'\n\
    solver = \"\"\"transport\"\"\"\nquality = \"fine\"\nmin-radius = 0x3\nfinish = \"polish=0.1mm,cutter=bull:d12mm,r1mm,step-over=0.1mm,gain=6\"\n";
const SIDE: &str = "[design]\npicture = \"a.png\"\nsize = \"100mm\"\n[bench]\nlight = \"parallel\"\nior = 1.5\nwidth-mm = 100.0\n\
    height-mm = 100.0\nentry-z-mm = -4.1\nrelief-mm = 2.5\nthinnest-mm = 3.0\ndistance-mm = 250.0\nwindow-width-mm = 100.0\n\
    window-height-mm = 100.0\nlight-direction = [0.0, 0.0, 1.0]\n[frame]\norigin-mm = [0.0, 0.0, 0.0]\n[picture]\nsha256 = \"0a\"\n\
    [files]\n\"b.stl\" = \"0b\"\n[height-maps.\"m.exr\"]\nMmPerPixelX = 0.1\n";
const CUTTERS: &str = "[[cutter]]\nname = \"ball\"\ncutter = \"ball:d6mm\"\nfeed = \"2000mm\"\nstep-overs = [0.1, \"0.2mm\"]\n\
    [[cutter]]\ncutter = \"flat:6mm\"\nfeed = 1e3\n";

/// A file may take this: its values, and the words of a refusal, which quotes it.
fn memory(length: usize) -> usize {
    (4 << 20) + 2000 * length
}

fn target<'a>(name: &'a str, corpus: &[&str]) -> Target<'a> {
    Target { name, corpus: corpus.iter().map(|text| text.as_bytes().to_vec()).collect(), mend: None, memory }
}

/// Reads bytes as text; a file of the program is read as text, too.
fn read_text(bytes: &[u8], read: impl Fn(&str) -> Read) -> Read {
    std::str::from_utf8(bytes).map_or(Read::Refused, read)
}

#[test]
fn design_files() {
    let path = Path::new("a.toml");
    target("design file", &[DESIGN]).run(cases(3000), |bytes| {
        read_text(bytes, |text| Read::of(spec::parse(text, path, "design file").and_then(layers::with_preset)))
    });
}

#[test]
fn side_files() {
    let path = Path::new("a.toml");
    target("side file", &[SIDE])
        .run(cases(3000), |bytes| read_text(bytes, |text| Read::of(SideFile::parse(text, path))));
}

#[test]
fn lists_of_cutters() {
    target("list of cutters", &[CUTTERS])
        .run(cases(3000), |bytes| read_text(bytes, |text| Read::of(CutterList::parse(text, Path::new("a.toml")))));
}

#[test]
fn words_of_the_command_line() {
    let words = [
        "250mm",
        "25mm,-3mm",
        "polish=0.1mm,cutter=bull:d12mm,r1mm,step-over=0.1mm,gain=6",
        "ball:r3mm",
        "45deg",
        "20deg,90deg",
        "gaussian:12deg",
        "distance=60..1000",
    ];
    target("words", &words).run(cases(10_000), |bytes| {
        read_text(bytes, |text| {
            let taken = [
                text.parse::<Length>().is_ok(),
                text.parse::<RimSize>().is_ok(),
                text.parse::<Shift>().is_ok(),
                text.parse::<FinishPlan>().is_ok(),
                text.parse::<Cutter>().is_ok(),
                text.parse::<Direction>().is_ok(),
                text.parse::<Inclination>().is_ok(),
                text.parse::<Emission>().is_ok(),
                text.parse::<Range>().is_ok(),
            ];
            if taken.contains(&true) { Read::Taken } else { Read::Refused }
        })
    });
}
