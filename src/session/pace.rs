//! How an animation runs through the time of a motion: evenly, smoothly, or as a table says.

use std::path::Path;

use crate::error::{Error, Result};

/// How fast an animation runs through the motion.
#[derive(Clone, Debug, PartialEq)]
pub enum Ease {
    /// Evenly.
    Linear,
    /// From rest to rest: `3 s^2 - 2 s^3`.
    Smooth,
    /// By a table: moments of the animation, in any unit and ascending, and the time of the motion at each, which never
    /// goes back. Straight from one to the next.
    Table(Vec<[f64; 2]>),
}

impl Ease {
    /// Reads a table: two numbers on each line, with a comma, a semicolon or spaces between them. A first line of words
    /// and lines that begin with `#` are left out.
    ///
    /// # Errors
    /// A file that cannot be read; a line that is not two numbers; moments that do not ascend, times that go back.
    pub fn read(path: &Path) -> Result<Self> {
        let name = path.display();
        let text = std::fs::read_to_string(path)
            .map_err(|error| Error::usage(format!("{name}: cannot be read ({error})")))?;
        let mut rows: Vec<[f64; 2]> = Vec::new();
        for (number, line) in text.lines().enumerate() {
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let wrong = |why: &str| Error::usage(format!("{name}:{}: {line}: {why}", number + 1));
            let words: Vec<&str> = line
                .split([',', ';', '\t', ' '])
                .filter(|word| !word.is_empty())
                .collect();
            let numbers: Vec<f64> = words.iter().filter_map(|word| word.parse().ok()).collect();
            if rows.is_empty() && numbers.is_empty() {
                continue;
            }
            let &[moment, time] = &numbers[..] else {
                return Err(wrong(
                    "must be two numbers, a moment and a time of the motion",
                ));
            };
            if words.len() != 2 || !moment.is_finite() || !time.is_finite() {
                return Err(wrong(
                    "must be two numbers, a moment and a time of the motion",
                ));
            }
            if let Some([before, earlier]) = rows.last() {
                if *before >= moment {
                    return Err(wrong("its moment is not after that of the line before"));
                }
                if *earlier > time {
                    return Err(wrong("the time of the motion goes back"));
                }
            }
            rows.push([moment, time]);
        }
        if rows.len() < 2 {
            return Err(Error::usage(format!(
                "{name}: must have two lines or more, each with a moment and a time of the motion"
            )));
        }
        Ok(Self::Table(rows))
    }

    /// The time of the motion at a share of the animation, of a motion from `first` to `last`.
    fn time(&self, share: f64, [first, last]: [f64; 2]) -> f64 {
        let eased = match self {
            Self::Linear => share,
            Self::Smooth => share * share * (3.0 - 2.0 * share),
            Self::Table(rows) => {
                let [from, to] = [rows[0][0], rows[rows.len() - 1][0]];
                let moment = from + share * (to - from);
                let after = rows.partition_point(|row| row[0] <= moment);
                let k = after.clamp(1, rows.len() - 1);
                let ([a, early], [b, late]) = (rows[k - 1], rows[k]);
                return early + ((moment - a) / (b - a)).clamp(0.0, 1.0) * (late - early);
            }
        };
        if eased == 1.0 {
            last
        } else {
            first + eased * (last - first)
        }
    }

    /// The times of the motion at `count` even moments of an animation.
    pub fn times(&self, count: usize, span: [f64; 2]) -> Vec<f64> {
        let share = |k: usize| k as f64 / (count.max(2) - 1) as f64;
        (0..count).map(|k| self.time(share(k), span)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_begin_and_end_with_the_motion_and_smooth_is_slow_at_both_ends() {
        let span = [10.0, 64.0];
        assert_eq!(Ease::Linear.times(3, span), [10.0, 37.0, 64.0]);
        let smooth = Ease::Smooth.times(5, span);
        assert_eq!((smooth[0], smooth[2], smooth[4]), (10.0, 37.0, 64.0));
        // 3/16 - 2/64 of the way.
        assert!((smooth[1] - (10.0 + 54.0 * 0.15625)).abs() < 1e-12);
        assert_eq!(Ease::Linear.times(1, span), [10.0]);
    }

    #[test]
    fn a_table_is_read_and_what_is_wrong_with_one_is_said_with_its_line() {
        let place = tempfile::tempdir().expect("a temporary folder");
        let path = place.path().join("ease.csv");
        let read = |text: &str| {
            std::fs::write(&path, text).expect("written");
            Ease::read(&path)
        };
        let ease = read("seconds,frame\n# held at the middle\n0,0\n1;10\n2 10\n4,20\n");
        let times = ease.expect("a table").times(5, [0.0, 20.0]);
        assert_eq!(times, [0.0, 10.0, 10.0, 15.0, 20.0]);
        for (text, told) in [
            ("0,0\n1,1,1\n", "ease.csv:2: 1,1,1: must be two numbers"),
            ("0,0\n1,x\n", "ease.csv:2: 1,x: must be two numbers"),
            ("0,0\n0,1\n", "ease.csv:2: 0,1: its moment is not after"),
            (
                "0,2\n1,1\n",
                "ease.csv:2: 1,1: the time of the motion goes back",
            ),
            ("0,inf\n", "ease.csv:1: 0,inf: must be two numbers"),
            ("a,b\n0,0\n", "must have two lines or more"),
        ] {
            let refused = read(text).expect_err(told).to_string();
            assert!(refused.contains(told), "{refused}");
        }
        std::fs::remove_file(&path).expect("removed");
        let refused = Ease::read(&path).expect_err("no file").to_string();
        assert!(refused.contains("cannot be read"), "{refused}");
    }
}
