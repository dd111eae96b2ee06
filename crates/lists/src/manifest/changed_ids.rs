//! Ids, and names of blocks, that a spreadsheet program made of others: it takes `1-11` for a date and `1E5` for a power of ten.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;
use std::path::Path;

use mocban_core::domain::spelling::quoted;

/// Number of lines that a warning names.
const SHOWN_LINES: usize = 3;
/// Number of ids in such a form that are too many for chance.
const SEVERAL: usize = 2;
/// Months as spreadsheet programs write them. In capitals, as in `MAR-01`, they are parts of real ids.
const MONTHS: [&str; 12] = [
    "Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec",
];
/// Years of dates. Other numbers of four digits are likely those of an inventory.
const YEARS: RangeInclusive<u32> = 1900..=2100;

/// Least number that spreadsheet programs shorten.
const LONG_NUMBER: f64 = 1e11;
/// Fewest decimals of a power of ten that no id has.
const MANY_DECIMALS: usize = 3;

/// Finds ids in the forms in which spreadsheet programs write dates and powers of ten: `1-Nov`, `Nov-01`, `01-Thg11`,
/// `2026-11-01`, `01.11.2026` and `1.00E+05`.
///
/// An id is right if the path of its mesh or print has it, as in `scans/2026-11-01.stl`. Of the others, there is a warning if a
/// path has what an id was made of, such as `1-11.stl` for `1-Nov`, if an id is a shortened long number, or if at least two ids
/// have such a form and other ids do not. Dates in numbers do not count as two if another id has a year and two numbers, too, as
/// in `1999.12.05` and `1999.13.01`.
///
/// So there is no warning about a list whose ids are all dates, and none about `1E5`, which no program writes for a power of ten.
#[derive(Debug, Default)]
pub struct ChangedIds {
    /// Dates in numbers.
    numeric: IdsOfForm,
    /// Dates with the name of a month, and powers of ten.
    others: IdsOfForm,
    /// Whether there are ids in another form.
    has_plain: bool,
    /// Whether one of them has a year and two numbers.
    has_year: bool,
    /// The names in such a form that were added, if rows may share one.
    blocks: Option<BTreeSet<String>>,
}

/// Ids in a form.
#[derive(Debug, Default)]
struct IdsOfForm {
    count: usize,
    /// The first ones with their lines.
    first: Vec<(usize, String)>,
    /// Whether a path has what one of them was made of, or one is a shortened number.
    is_proved: bool,
}

impl IdsOfForm {
    fn add(&mut self, line: usize, id: &str, is_proved: bool) {
        self.count += 1;
        self.is_proved |= is_proved;
        if self.first.len() < SHOWN_LINES {
            self.first.push((line, id.to_owned()));
        }
    }
}

impl ChangedIds {
    /// Finds blocks of pairs instead of ids. Each counts once.
    pub fn of_blocks() -> Self {
        Self {
            blocks: Some(BTreeSet::new()),
            ..Self::default()
        }
    }

    /// Adds the id of a row with the paths of its files.
    pub fn add(&mut self, line: usize, id: &str, files: [&Path; 2]) {
        let Some(form) = SpreadsheetForm::of(id) else {
            self.has_plain = true;
            self.has_year |= has_year_and_two_numbers(id);
            return;
        };
        if let Some(blocks) = &mut self.blocks
            && !blocks.insert(id.to_owned())
        {
            return;
        }
        let paths = files.map(|file| file.to_string_lossy().to_lowercase());
        let folded = id.to_lowercase();
        if paths.iter().any(|path| path.contains(&folded)) {
            return;
        }
        let has_origin = paths.iter().any(|path| {
            let path = path.rsplit_once('.').map_or(&**path, |(stem, _)| stem);
            path.split(['/', '\\']).any(|name| form.is_made_of(name))
        });
        let is_proved = has_origin || form.is_shortened();
        let ids = if form.is_numeric() {
            &mut self.numeric
        } else {
            &mut self.others
        };
        ids.add(line, id, is_proved);
    }

    /// Returns a warning, if ids seem to be changed.
    pub fn warning(&self) -> Option<String> {
        let are_several = |ids: &IdsOfForm| ids.count >= SEVERAL && self.has_plain;
        let numeric = &self.numeric;
        let has_numeric = numeric.is_proved || are_several(numeric) && !self.has_year;
        let has_others = self.others.is_proved || are_several(&self.others);
        let found = [(numeric, has_numeric), (&self.others, has_others)];
        let found = found.into_iter().filter(|(_, is_found)| *is_found);
        let found: Vec<&IdsOfForm> = found.map(|(ids, _)| ids).collect();
        let count: usize = found.iter().map(|ids| ids.count).sum();
        let mut first: Vec<_> = found.iter().flat_map(|ids| &ids.first).collect();
        first.sort();
        let (line, id) = first.first()?;
        let id = quoted(id);
        let advice = "give the column the format Text, correct its cells and save the list again, best as XLSX";
        let are_blocks = self.blocks.is_some();
        if count == 1 {
            return Some(if are_blocks {
                format!(
                    "the block {id} on line {line} looks like a date or a power of ten: a spreadsheet program may have made it of a text such as 1-11 or 1E5; {advice}"
                )
            } else {
                format!(
                    "the id {id} on line {line} looks like a date or a power of ten: a spreadsheet program may have made it of a text such as 1-11 or 1E5; {advice}"
                )
            });
        }
        let lines = first.iter().take(SHOWN_LINES);
        let lines: Vec<String> = lines.map(|(line, _)| line.to_string()).collect();
        let lines = lines.join(", ");
        Some(if are_blocks {
            format!(
                "{count} blocks look like dates or powers of ten, such as {id} (lines {lines}): a spreadsheet program may have made them of texts such as 1-11 and 1E5; {advice}"
            )
        } else {
            format!(
                "{count} ids look like dates or powers of ten, such as {id} (lines {lines}): a spreadsheet program may have made them of texts such as 1-11 and 1E5; {advice}"
            )
        })
    }
}

/// What a spreadsheet program writes for a text that it took for something else.
#[derive(Debug, Clone, Copy, PartialEq)]
enum SpreadsheetForm {
    /// A date.
    Date {
        /// Day and month, or month and year, in any order.
        numbers: [u32; 2],
        /// The year beside day and month.
        year: Option<u32>,
        /// Whether the month is a number.
        is_numeric: bool,
    },
    /// A power of ten.
    Power {
        value: f64,
        /// Digits behind the point.
        decimals: usize,
    },
}

impl SpreadsheetForm {
    /// Returns the form of an id, if it is one of them.
    fn of(id: &str) -> Option<Self> {
        power(id).or_else(|| date(id))
    }

    const fn is_numeric(self) -> bool {
        matches!(
            self,
            Self::Date {
                is_numeric: true,
                ..
            }
        )
    }

    /// Returns whether this is a long number of which a program left out digits, such as `1.23457E+11`: no id has such a form.
    fn is_shortened(self) -> bool {
        matches!(self, Self::Power { value, decimals } if value >= LONG_NUMBER && decimals >= MANY_DECIMALS)
    }

    /// Returns whether a program may write this form for the end of a name.
    fn is_made_of(self, name: &str) -> bool {
        match self {
            Self::Power { value, decimals } => {
                let end = name.rsplit(['_', '-', ' ']).next().unwrap_or(name);
                let number = end.parse::<f64>().ok().filter(|number| number.is_finite());
                number.is_some_and(|number| {
                    format!("{number:.decimals$e}").parse::<f64>() == Ok(value)
                })
            }
            Self::Date { numbers, year, .. } => {
                let words = name.split(|c: char| !c.is_ascii_digit());
                let found: Vec<u32> = words.filter_map(|word| word.parse().ok()).collect();
                let [before @ .., a, b] = found.as_slice() else {
                    return false;
                };
                let short = |number: u32| {
                    if YEARS.contains(&number) {
                        number % 100
                    } else {
                        number
                    }
                };
                // A name with the year is that of the same date in another form.
                let is_year = |number: &u32| year.map(short) == Some(short(*number));
                let (mut ends, mut wanted) = ([*a, *b].map(short), numbers);
                ends.sort_unstable();
                wanted.sort_unstable();
                ends == wanted && !before.iter().any(is_year)
            }
        }
    }
}

/// Parses a power of ten with the sign and the digits that programs write, such as `1E+05` or `1,25E-10`.
fn power(id: &str) -> Option<SpreadsheetForm> {
    let (mantissa, exponent) = id.split_once('E')?;
    let digits = exponent.strip_prefix(['+', '-'])?;
    let (whole, fraction) = mantissa.split_once(['.', ',']).unwrap_or((mantissa, ""));
    let is_form = whole.len() == 1 && (2..=3).contains(&digits.len());
    if !is_form || ![whole, fraction, digits].into_iter().all(is_digits) {
        return None;
    }
    Some(SpreadsheetForm::Power {
        value: format!("{whole}.{fraction}E{exponent}").parse().ok()?,
        decimals: fraction.len(),
    })
}

/// Parses a date with day and month, month and year, or all three.
fn date(id: &str) -> Option<SpreadsheetForm> {
    let separator = if id.contains('-') { '-' } else { '.' };
    let parts: Vec<&str> = id.splitn(4, separator).collect();
    let of = |numbers, year, is_numeric| SpreadsheetForm::Date {
        numbers,
        year,
        is_numeric,
    };
    match *parts.as_slice() {
        [first, second] => {
            let numbers = match (month(first), month(second)) {
                (None, Some(month)) => [number(first, &(1..=31))?, month],
                (Some(month), None) if second.len() == 2 => [month, number(second, &(0..=99))?],
                _ => return None,
            };
            Some(of(numbers, None, false))
        }
        [day, name, year] if month(name).is_some() => {
            let year = number(year, &(0..=99)).or_else(|| number(year, &YEARS))?;
            let numbers = [number(day, &(1..=31))?, month(name)?];
            Some(of(numbers, Some(year), false))
        }
        [a, b, c] => {
            let (year, numbers) = if a.len() == 4 {
                (a, [b, c])
            } else {
                (c, [a, b])
            };
            if year.len() != 4 || numbers.map(str::len) != [2; 2] {
                return None;
            }
            let numbers = [
                number(numbers[0], &(1..=31))?,
                number(numbers[1], &(1..=31))?,
            ];
            let has_month = numbers.into_iter().any(|number| number <= 12);
            let year = number(year, &YEARS).filter(|_| has_month)?;
            Some(of(numbers, Some(year), true))
        }
        _ => None,
    }
}

/// Returns whether an id has the parts of a date in numbers, also if there is no such date.
fn has_year_and_two_numbers(id: &str) -> bool {
    let parts: Vec<&str> = id.splitn(4, ['-', '.']).collect();
    let has_year = parts.iter().any(|part| part.len() == 4);
    parts.len() == 3 && has_year && parts.into_iter().all(is_digits)
}

/// Returns the number of a month from its name in English, or in Vietnamese, such as `Thg11`.
fn month(name: &str) -> Option<u32> {
    if let Some(month) = name.strip_prefix("Thg") {
        return number(month.trim_start(), &(1..=12));
    }
    let at = MONTHS.iter().position(|month| *month == name)?;
    Some(at as u32 + 1)
}

/// Parses a number of at most four digits in a range.
fn number(text: &str, range: &RangeInclusive<u32>) -> Option<u32> {
    let is_number = (1..=4).contains(&text.len()) && is_digits(text);
    let number = text.parse::<u32>().ok().filter(|_| is_number);
    number.filter(|number| range.contains(number))
}

fn is_digits(text: &str) -> bool {
    text.bytes().all(|byte| byte.is_ascii_digit())
}

#[cfg(test)]
mod tests;
