//! JPEG, through the crate `zune-jpeg`, which goes on where a file is damaged: so the scans are
//! walked through first.

use std::io::Cursor;

use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;

use super::codes::{Coded, Curve, Said, Space};
use super::primaries::Primaries;
use super::raster::Codes;
use super::{Problem, check_size};

pub(super) fn decode(bytes: &[u8]) -> Result<Coded, Problem> {
    let frame = Scans::walk(bytes)?;
    let (width, height) = (frame.width, frame.height);
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(width)
        .set_max_height(height)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(Cursor::new(bytes), options);
    let data = decoder
        .decode()
        .map_err(|error| Problem::corrupt(format!("{error:?}").replace('\n', " ")))?;
    let grey = decoder.input_colorspace() == Some(ColorSpace::Luma);
    let profile = decoder.icc_profile();
    let exif = decoder.exif().map(Vec::as_slice);
    let space = match profile {
        Some(profile) => Space::of_profile(&profile, grey)?,
        None if exif.is_some_and(says_adobe_rgb) => {
            let adobe = Primaries {
                green: [0.21, 0.71],
                ..Primaries::REC709
            };
            Space::of(Curve::Power(2.0 + 51.0 / 256.0), adobe)?
        }
        None => Space::SRGB,
    };
    if data.len() != 3 * width * height {
        return Err(Problem::corrupt("its pixels do not fit its size"));
    }
    Ok(Coded {
        said: Said {
            has_gain_map: frame.gain_map,
            ..exif.map(Said::of_exif).unwrap_or_default()
        },
        ..space.picture([width, height], Codes::Eight(data), None)
    })
}

/// Whether EXIF says Adobe RGB (1998), as cameras do: colour space "uncalibrated" and the option
/// file R03 of DCF.
fn says_adobe_rgb(exif: &[u8]) -> bool {
    let Ok(exif) = exif::Reader::new().read_raw(exif.to_vec()) else {
        return false;
    };
    let index = exif.get_field(exif::Tag::InteroperabilityIndex, exif::In::PRIMARY);
    index.is_some_and(
        |field| matches!(&field.value, exif::Value::Ascii(text) if text.concat().starts_with(b"R03")),
    )
}

/// Whether an application's segment speaks of a gain map: Adobe's and Google's in XMP, Apple's in XMP,
/// or that of ISO 21496-1.
fn says_gain_map(segment: &[u8]) -> bool {
    let says = |words: &[u8]| segment.windows(words.len()).any(|window| window == words);
    let xmp = segment.starts_with(b"http://ns.adobe.com/xap/1.0/\0");
    segment.starts_with(b"urn:iso:std:iso:ts:21496:-1\0")
        || (xmp && (says(b"hdrgm:") || says(b"HDRGainMap")))
}

/// One component of the frame.
struct Component {
    id: u8,
    /// Sampling factors, horizontal and vertical.
    sampling: [usize; 2],
    /// Blocks of 8 × 8 of its own picture, across and down.
    blocks: [usize; 2],
    /// Of progressive files: a bit for each coefficient of each block, rows of whole units, that is
    /// not zero so far.
    nonzero: Vec<u64>,
    stride: usize,
    scanned: bool,
}

/// A Huffman table: for each 16 bits the length and the symbol of the code that they begin with.
type Table = Vec<(u8, u8)>;

/// A walk through the entropy-coded data of a file, by which what is missing, left over or out of
/// step is found.
///
/// ITU-T T.81, annexes B, F and G. Nothing is decoded but lengths; the values are the decoder's.
struct Scans<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Bits taken from the bytes and not used yet, and their number.
    ahead: u64,
    held: u32,
    width: usize,
    height: usize,
    progressive: bool,
    gain_map: bool,
    components: Vec<Component>,
    /// Of direct and of alternating coefficients.
    tables: [[Option<Table>; 4]; 2],
    /// Units between restarts; 0 without.
    restart: usize,
}

/// A part of T.81 that is not read here.
fn unread(what: &str) -> Problem {
    Problem::new(
        format!("the JPEG {what}, which is not read here"),
        "store it again as an ordinary JPEG (baseline or progressive, RGB or grey), or as PNG",
    )
}

fn out_of_step() -> Problem {
    Problem::corrupt("its compressed pixels are damaged or cut off")
}

/// The spectral band and the precision of a scan.
#[derive(Clone, Copy)]
struct Band {
    start: usize,
    end: usize,
    /// Whether bits refine what an earlier scan gave.
    refines: bool,
}

impl<'a> Scans<'a> {
    /// The frame, once all that should be in the file was found in it.
    fn walk(bytes: &'a [u8]) -> Result<Self, Problem> {
        let mut this = Self {
            bytes,
            at: 2,
            ahead: 0,
            held: 0,
            width: 0,
            height: 0,
            progressive: false,
            gain_map: false,
            components: Vec::new(),
            tables: Default::default(),
            restart: 0,
        };
        loop {
            let marker = this.marker()?;
            if marker == 0xd9 {
                break;
            }
            if marker == 0x01 || (0xd0..=0xd8).contains(&marker) {
                continue;
            }
            let segment = this.segment()?;
            match marker {
                0xc0..=0xc2 => this.frame(segment, marker == 0xc2)?,
                0xc3 | 0xc5..=0xc7 | 0xc9..=0xcb | 0xcd..=0xcf => {
                    return Err(unread("is lossless, hierarchical or arithmetically coded"));
                }
                0xc4 => this.huffman(segment)?,
                0xdd => {
                    let [high, low] = *segment else {
                        return Err(out_of_step());
                    };
                    this.restart = usize::from(u16::from_be_bytes([high, low]));
                }
                0xda => this.scan(segment)?,
                0xe1 | 0xe2 => this.gain_map |= says_gain_map(segment),
                _ => {}
            }
        }
        if this.components.is_empty() || this.components.iter().any(|c| !c.scanned) {
            return Err(out_of_step());
        }
        Ok(this)
    }

    /// The code of the next marker, which must stand here but for what fills up.
    fn marker(&mut self) -> Result<u8, Problem> {
        loop {
            match self.bytes.get(self.at..self.at + 2) {
                None => return Err(Problem::truncated()),
                Some([0xff, 0xff] | [0, _]) => self.at += 1,
                Some([0xff, code]) if *code != 0 => {
                    self.at += 2;
                    return Ok(*code);
                }
                Some(_) => return Err(out_of_step()),
            }
        }
    }

    fn segment(&mut self) -> Result<&'a [u8], Problem> {
        let rest = &self.bytes[self.at..];
        let [high, low, ..] = *rest else {
            return Err(Problem::truncated());
        };
        let length = usize::from(u16::from_be_bytes([high, low]));
        if rest.len() < length {
            return Err(Problem::truncated());
        }
        self.at += length;
        rest.get(2..length).ok_or_else(out_of_step)
    }

    fn frame(&mut self, segment: &[u8], progressive: bool) -> Result<(), Problem> {
        let [precision, h1, h0, w1, w0, count, components @ ..] = segment else {
            return Err(out_of_step());
        };
        if !self.components.is_empty() || components.len() != 3 * usize::from(*count) {
            return Err(out_of_step());
        }
        if *precision != 8 {
            return Err(unread(&format!("has {precision} bits a sample")));
        }
        if !matches!(count, 1 | 3) {
            return Err(unread(&format!("has {count} components, as CMYK has")));
        }
        self.progressive = progressive;
        self.height = usize::from(u16::from_be_bytes([*h1, *h0]));
        self.width = usize::from(u16::from_be_bytes([*w1, *w0]));
        check_size(self.width, self.height, self.bytes.len())?;
        let (components, _) = components.as_chunks::<3>();
        let of = |shift: u8| {
            components
                .iter()
                .map(move |c| usize::from(c[1] >> shift & 15))
        };
        let (h_max, v_max) = (of(4).max().unwrap_or(1), of(0).max().unwrap_or(1));
        for &[id, factors, _] in components {
            let sampling = [usize::from(factors >> 4), usize::from(factors & 15)];
            if !sampling.iter().all(|factor| (1..=4).contains(factor)) {
                return Err(out_of_step());
            }
            let blocks = |length: usize, factor: usize, most: usize| {
                (length * factor).div_ceil(most).div_ceil(8)
            };
            let stride = self.width.div_ceil(8 * h_max) * sampling[0];
            let rows = self.height.div_ceil(8 * v_max) * sampling[1];
            self.components.push(Component {
                id,
                sampling,
                blocks: [
                    blocks(self.width, sampling[0], h_max),
                    blocks(self.height, sampling[1], v_max),
                ],
                nonzero: vec![0; if progressive { stride * rows } else { 0 }],
                stride,
                scanned: false,
            });
        }
        Ok(())
    }

    fn huffman(&mut self, mut segment: &[u8]) -> Result<(), Problem> {
        while let [class, rest @ ..] = segment {
            let (counts, rest) = rest.split_at_checked(16).ok_or_else(out_of_step)?;
            let count = counts.iter().map(|n| usize::from(*n)).sum();
            let (symbols, rest) = rest.split_at_checked(count).ok_or_else(out_of_step)?;
            let mut table = Vec::with_capacity(1 << 16);
            let mut symbols = symbols.iter();
            for (length, &count) in (1u8..).zip(counts) {
                for &symbol in symbols.by_ref().take(usize::from(count)) {
                    table.resize(table.len() + (1 << (16 - length)), (length, symbol));
                }
            }
            if table.len() > 1 << 16 || class & 15 > 3 || class >> 4 > 1 {
                return Err(out_of_step());
            }
            table.resize(1 << 16, (0, 0));
            self.tables[usize::from(class >> 4)][usize::from(class & 15)] = Some(table);
            segment = rest;
        }
        Ok(())
    }

    fn scan(&mut self, segment: &[u8]) -> Result<(), Problem> {
        let [count, rest @ ..] = segment else {
            return Err(out_of_step());
        };
        let count = usize::from(*count);
        let (selected, rest) = rest.split_at_checked(2 * count).ok_or_else(out_of_step)?;
        let [start, end, precision] = *rest else {
            return Err(out_of_step());
        };
        let band = Band {
            start: usize::from(start),
            end: usize::from(end),
            refines: precision >> 4 > 0,
        };
        if band.start > band.end || band.end > 63 || count == 0 {
            return Err(out_of_step());
        }
        let subsampled = self
            .components
            .iter()
            .any(|c| c.sampling != self.components[0].sampling);
        if !self.progressive && count < self.components.len() && subsampled {
            return Err(unread("stores each of its subsampled components by itself"));
        }
        let mut parts = Vec::with_capacity(count);
        let (selected, _) = selected.as_chunks::<2>();
        for &[id, tables] in selected {
            let index = self.components.iter().position(|c| c.id == id);
            parts.push((index.ok_or_else(out_of_step)?, tables));
        }
        (self.ahead, self.held) = (0, 0);
        // One component by itself has its own blocks; several have whole units of all.
        let single = count == 1;
        let first = &self.components[parts[0].0];
        let [across, down] = if single {
            first.blocks
        } else {
            [first.stride / first.sampling[0], {
                let v_max = self.components.iter().map(|c| c.sampling[1]).max();
                self.height.div_ceil(8 * v_max.unwrap_or(1))
            }]
        };
        let mut end_of_band = 0;
        for unit in 0..across * down {
            if self.restart > 0 && unit > 0 && unit % self.restart == 0 {
                self.finish_bits()?;
                let expected = 0xd0 + ((unit / self.restart - 1) % 8) as u8;
                if self.marker()? != expected {
                    return Err(out_of_step());
                }
                end_of_band = 0;
            }
            let (row, column) = (unit / across, unit % across);
            for &(index, tables) in &parts {
                let [h, v] = if single {
                    [1, 1]
                } else {
                    self.components[index].sampling
                };
                for k in 0..h * v {
                    let (row, column) = (row * v + k / h, column * h + k % h);
                    let place = row * self.components[index].stride + column;
                    self.block(index, place, tables, band, &mut end_of_band)
                        .ok_or_else(out_of_step)?;
                }
            }
        }
        for &(index, _) in &parts {
            self.components[index].scanned |= band.start == 0;
        }
        self.finish_bits()
    }

    /// Goes over one block's part of a scan.
    fn block(
        &mut self,
        index: usize,
        place: usize,
        tables: u8,
        band: Band,
        end_of_band: &mut u32,
    ) -> Option<()> {
        let (direct, alternating) = (usize::from(tables >> 4), usize::from(tables & 15));
        if !self.progressive {
            let length = self.symbol(0, direct)?;
            self.take(u32::from(length))?;
            let mut k = 1;
            while k < 64 {
                let symbol = self.symbol(1, alternating)?;
                let (run, length) = (usize::from(symbol >> 4), u32::from(symbol & 15));
                if length == 0 && run < 15 {
                    break;
                }
                k += run + 1;
                self.take(length)?;
            }
            return (k <= 64).then_some(());
        }
        if band.start == 0 {
            let length = if band.refines {
                1
            } else {
                u32::from(self.symbol(0, direct)?)
            };
            self.take(length)?;
            return Some(());
        }
        let mut nonzero = *self.components[index].nonzero.get(place)?;
        let mut k = band.start;
        if *end_of_band == 0 {
            while k <= band.end {
                let symbol = self.symbol(1, alternating)?;
                let (mut run, length) = (usize::from(symbol >> 4), u32::from(symbol & 15));
                if length == 0 && run < 15 {
                    *end_of_band = (1 << run) + self.take(run as u32)?;
                    break;
                }
                self.take(length)?;
                if band.refines {
                    // A run counts coefficients that are zero still; the others have a bit each.
                    while k <= band.end {
                        if nonzero >> k & 1 == 1 {
                            self.take(1)?;
                        } else if run == 0 {
                            break;
                        } else {
                            run -= 1;
                        }
                        k += 1;
                    }
                } else {
                    k += run;
                }
                if length > 0 {
                    if k > band.end {
                        return None;
                    }
                    nonzero |= 1 << k;
                }
                k += 1;
            }
        }
        if *end_of_band > 0 {
            *end_of_band -= 1;
            if band.refines {
                let rest = (k..=band.end).filter(|k| nonzero >> k & 1 == 1).count();
                for _ in 0..rest {
                    self.take(1)?;
                }
            }
        }
        self.components[index].nonzero[place] = nonzero;
        Some(())
    }

    /// Fills up the bits that are held, as far as no marker comes.
    fn fill(&mut self) {
        while self.held <= 48 {
            let byte = match self.bytes.get(self.at..) {
                Some([0xff, 0, ..]) => {
                    self.at += 2;
                    0xff
                }
                Some([byte, ..]) if *byte != 0xff => {
                    self.at += 1;
                    *byte
                }
                _ => return,
            };
            self.ahead = self.ahead << 8 | u64::from(byte);
            self.held += 8;
        }
    }

    /// So many bits, at most 16, if there are as many before the next marker.
    fn take(&mut self, count: u32) -> Option<u32> {
        self.fill();
        self.held = self.held.checked_sub(count)?;
        Some((self.ahead >> self.held) as u32 & ((1 << count) - 1))
    }

    /// The next symbol of a table, of direct or of alternating coefficients.
    fn symbol(&mut self, class: usize, number: usize) -> Option<u8> {
        self.fill();
        let next = if self.held >= 16 {
            self.ahead >> (self.held - 16)
        } else {
            self.ahead << (16 - self.held)
        };
        let table = self.tables[class].get(number)?.as_ref()?;
        let (length, symbol) = table[(next & 0xffff) as usize];
        self.held = self.held.checked_sub(u32::from(length))?;
        // No code begins so; and no value has more than 16 bits.
        (length > 0 && (class == 1 || symbol <= 16)).then_some(symbol)
    }

    /// The end of a scan or an interval: less than a byte is left.
    fn finish_bits(&mut self) -> Result<(), Problem> {
        self.fill();
        if self.held >= 8 {
            return Err(out_of_step());
        }
        (self.ahead, self.held) = (0, 0);
        Ok(())
    }
}
