//! STL as text, in every dialect: keywords in any case, several solids, anything for normals,
//! decimal commas, any ends of lines.

use super::fault::malformed;
use crate::{
    load::{assemble::Assembler, error::LoadError},
    mesh::Mesh,
};
use glam::DVec3;
use rayon::prelude::*;

/// Bytes parsed by one task, and tasks at a time.
const PIECE: usize = 1 << 20;
const PIECES: usize = 16;
/// How far a file is looked at to tell what it is.
const BEGINNING: usize = 1 << 12;

const MARK: &[u8] = b"\xef\xbb\xbf";

/// Whether a file that is no exact binary one is text.
pub(super) fn is_text(bytes: &[u8]) -> Result<bool, LoadError> {
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return Err(malformed("it is text in UTF-16, which is not understood: save it as ASCII or UTF-8"));
    }
    let beginning = &bytes[..bytes.len().min(BEGINNING)];
    // The count of a binary file has a zero byte, and so have most of its numbers.
    let said = |word: &[u8]| beginning.windows(word.len()).any(|found| found.eq_ignore_ascii_case(word));
    Ok(!beginning.contains(&0) && (said(b"facet") || said(b"solid")))
}

/// Parses all solids of a file together, on all cores.
pub(super) fn parse(bytes: &[u8]) -> Result<Mesh, LoadError> {
    let mut rest = bytes.strip_prefix(MARK).unwrap_or(bytes);
    let mut assembler = Assembler::new(bytes.len() / 256);
    while !rest.is_empty() {
        let mut pieces = Vec::with_capacity(PIECES);
        while pieces.len() < PIECES && !rest.is_empty() {
            let (piece, after) = rest.split_at(next_facet(rest, PIECE));
            pieces.push(piece);
            rest = after;
        }
        let parsed: Vec<(Vec<[DVec3; 3]>, Option<LoadError>)> = pieces.par_iter().map(|piece| facets(piece)).collect();
        for (triangles, fault) in parsed {
            for triangle in triangles {
                assembler.triangle(triangle)?;
            }
            if let Some(fault) = fault {
                return Err(fault);
            }
        }
    }
    assembler.finish(Vec::new())
}

/// Where the first line from `from` on begins with "facet", or the text ends.
fn next_facet(text: &[u8], from: usize) -> usize {
    let mut at = from.min(text.len());
    while let Some(end) = text[at..].iter().position(|byte| is_end(*byte)) {
        at += end + 1;
        let mut words = Words(&text[at..]);
        if words.next_in_line().is_some_and(|word| word.eq_ignore_ascii_case(b"facet")) {
            return at;
        }
    }
    text.len()
}

fn is_end(byte: u8) -> bool {
    byte == b'\n' || byte == b'\r'
}

/// The triangles of a piece, up to the first fault.
fn facets(text: &[u8]) -> (Vec<[DVec3; 3]>, Option<LoadError>) {
    let mut triangles = Vec::with_capacity(text.len() / 256);
    let mut words = Words(text);
    let fault = facets_of(&mut words, &mut triangles).err();
    (triangles, fault)
}

fn facets_of(words: &mut Words<'_>, triangles: &mut Vec<[DVec3; 3]>) -> Result<(), LoadError> {
    let (mut corners, mut count, mut within) = ([DVec3::ZERO; 3], 0, false);
    while let Some(word) = words.next() {
        // Names and what programs write behind "endfacet" end with the line, normals are not
        // needed.
        if is(word, b"vertex") {
            let slot = corners.get_mut(count).filter(|_| within);
            let Some(slot) = slot else { return Err(odd("a vertex", "stands outside of a facet of three", words)) };
            *slot = vertex(words)?;
            count += 1;
        } else if is(word, b"facet") {
            if within {
                return Err(odd("a facet", "begins within another", words));
            }
            (within, count) = (true, 0);
            words.skip_line(b"outer");
        } else if is(word, b"endfacet") {
            if !within || count != 3 {
                return Err(odd("a facet", &format!("has {count} vertices instead of 3"), words));
            }
            triangles.push(corners);
            within = false;
            words.skip_line(b"facet");
        } else if is(word, b"solid") || is(word, b"endsolid") {
            if within {
                return Err(odd("a solid", "begins or ends within a facet", words));
            }
            words.skip_line(b"");
        } else if !within {
            // Notes between the facets.
            words.skip_line(b"facet");
        } else if ![&b"outer"[..], b"loop", b"endloop", b"end"].iter().any(|known| is(word, known)) {
            let word = String::from_utf8_lossy(word).into_owned();
            return Err(odd(&format!("'{word}'"), "is not understood within a facet", words));
        }
    }
    if within { Err(malformed("it ends within a facet")) } else { Ok(()) }
}

fn is(word: &[u8], keyword: &[u8]) -> bool {
    word.eq_ignore_ascii_case(keyword)
}

fn odd(what: &str, why: &str, words: &Words<'_>) -> LoadError {
    let mut after = Words(words.0);
    let line = after.line().trim_ascii();
    malformed(format!("{what} {why}, before '{}'", String::from_utf8_lossy(&line[..line.len().min(60)])))
}

fn vertex(words: &mut Words<'_>) -> Result<DVec3, LoadError> {
    let mut at = [0.0; 3];
    for value in &mut at {
        let word = words.next_in_line().ok_or_else(|| malformed("a vertex has not three numbers"))?;
        *value = number(word)
            .ok_or_else(|| malformed(format!("the coordinate '{}' is no number", String::from_utf8_lossy(word))))?;
    }
    Ok(at.into())
}

/// A coordinate, with a decimal point or a decimal comma.
fn number(word: &[u8]) -> Option<f64> {
    if let Ok(value) = fast_float2::parse(word) {
        return Some(value);
    }
    let commas = word.iter().filter(|&&byte| byte == b',').count();
    // With both it is not known which of them parts thousands.
    if commas != 1 || word.len() > 64 || word.contains(&b'.') {
        return None;
    }
    let pointed: Vec<u8> = word.iter().map(|&byte| if byte == b',' { b'.' } else { byte }).collect();
    fast_float2::parse(&pointed).ok()
}

/// The words of a text.
struct Words<'a>(&'a [u8]);

impl<'a> Words<'a> {
    fn next(&mut self) -> Option<&'a [u8]> {
        let begin = self.0.iter().position(|byte| !byte.is_ascii_whitespace())?;
        self.0 = &self.0[begin..];
        self.next_in_line()
    }

    fn next_in_line(&mut self) -> Option<&'a [u8]> {
        let begin = self.0.iter().position(|byte| !byte.is_ascii_whitespace() || is_end(*byte))?;
        let text = &self.0[begin..];
        let length = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
        let (word, rest) = text.split_at(length);
        self.0 = rest;
        (!word.is_empty()).then_some(word)
    }

    /// The rest of the line.
    fn line(&mut self) -> &'a [u8] {
        let length = self.0.iter().position(|byte| is_end(*byte)).unwrap_or(self.0.len());
        let (line, rest) = self.0.split_at(length);
        self.0 = rest;
        line
    }

    /// Passes over the rest of the line, or up to this word: some files are one line.
    fn skip_line(&mut self, until: &[u8]) {
        let whole = self.0;
        let mut line = Words(self.line());
        let after = self.0;
        loop {
            let before = line.0;
            match line.next_in_line() {
                None => break,
                Some(word) if !until.is_empty() && is(word, until) => {
                    self.0 = &whole[whole.len() - after.len() - before.len()..];
                    return;
                }
                Some(_) => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::parse, *};

    const CORNERS: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 1.25, 0.0], [0.0, 0.0, 1e1]];
    const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    fn plain() -> String {
        let mut text = String::from("solid part\n");
        for face in FACES {
            text += "  facet normal 0 0 1\n    outer loop\n";
            face.map(|v| CORNERS[v]).iter().for_each(|[x, y, z]| text += &format!("      vertex {x} {y} {z:e}\n"));
            text += "    endloop\n  endfacet\n";
        }
        text + "endsolid part\n"
    }

    #[test]
    fn every_dialect_is_the_same_solid() {
        let mesh = parse(plain().as_bytes()).unwrap();
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (4, 4));
        let changed = |from: &str, to: &str| {
            let text = plain();
            assert!(text.contains(from), "{from}");
            text.replace(from, to)
        };
        let parted = plain().replacen("  facet", "endsolid part\nsolid other\n  facet", 3).replacen(
            "endsolid part\nsolid other\n",
            "",
            1,
        );
        for text in [
            changed("normal 0 0 1", "normal nan -nan NaN"),
            changed("normal 0 0 1", "normal -1.#IND -1.#IND 1.#QNAN"),
            changed("normal 0 0 1", "normal"),
            changed("normal 0 0 1", ""),
            changed("endloop", "end loop"),
            changed("endfacet", "endfacet attribute 31"),
            changed(".", ","),
            changed("\n", "\r\n"),
            changed("\n", "\r"),
            changed("\n", " \t \n\n"),
            changed("endsolid part\n", ""),
            changed("solid part", "solid"),
            changed("solid part", "solid facet vertex 1 2 3"),
            changed("  facet", "\tfacet"),
            plain().to_uppercase(),
            format!("\u{feff}{}", plain()),
            format!("\n  \n{}", plain()),
            format!("written by a program\n{}", plain()),
            parted,
            changed("solid part\n", "solid part\n")
                .replacen('\n', "\u{1}", 1)
                .replace('\n', " ")
                .replace('\u{1}', "\n"),
        ] {
            let found = parse(text.as_bytes());
            assert!(found.as_ref().is_ok_and(|found| *found == mesh), "{found:?} of\n{text}");
        }
    }

    #[test]
    fn what_is_no_facet_is_named() {
        let named = |from: &str, to: &str, words: &str| {
            let text = plain();
            assert!(text.contains(from), "{from}");
            let reason = parse(text.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
            assert!(reason.contains(words), "{from} -> {to}: {reason}");
        };
        named("vertex 1.5", "vertx 1.5", "'vertx'");
        named("vertex 1.5 0 0e0\n", "", "2 vertices instead of 3");
        named("vertex 1.5", "vertex 1 2 3\nvertex 1.5", "outside of a facet of three");
        named("vertex 1.5", "vertex -1.#IND", "'-1.#IND' is no number");
        named("vertex 1.5", "vertex 1.234,5", "'1.234,5' is no number");
        named("vertex 1.5 0 0e0", "vertex 1.5 0", "not three numbers");
        named("vertex 1.5", "vertex nan", "not finite");
        named("endfacet", "", "within another");
        let text = plain();
        let cut = &text[..text.rfind("endfacet").unwrap()];
        assert!(parse(cut.as_bytes()).unwrap_err().to_string().contains("ends within a facet"));
        let wide: Vec<u8> = std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
        assert!(parse(&wide).unwrap_err().to_string().contains("UTF-16"));
    }

    #[test]
    fn long_files_are_read_in_pieces_that_keep_their_order() {
        let n = 20_000;
        let mut text = String::from("solid long\n");
        for k in 0..n {
            text += "facet normal 0 0 0\nouter loop\n";
            (0..3).for_each(|c| text += &format!("vertex {}.125 {} {}\n", k + c, c * c, k % 7));
            text += "endloop\nendfacet\n";
        }
        assert!(text.len() > 2 * PIECE - PIECE / 2);
        let mesh = parse(text.as_bytes()).unwrap();
        assert_eq!(mesh.triangles.len(), n);
        assert!((0..n).all(|k| mesh.corners(k)[1].x == (k + 1) as f64 + 0.125));
    }
}
