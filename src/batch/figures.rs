//! The figures of a job as a row, and rows as files that programs read: CSV, and Parquet.

use std::io::{self, Write};
use std::sync::Arc;

use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::parser::parse_message_type;

/// One figure.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cell {
    Text(String),
    Count(Option<u64>),
    Number(Option<f64>),
}

impl Cell {
    /// A field of a CSV (RFC 4180).
    pub(super) fn field(&self) -> String {
        let text = match self {
            Self::Text(text) => text.clone(),
            Self::Count(count) => count.map_or_else(String::new, |count| count.to_string()),
            Self::Number(number) => number.map_or_else(String::new, |number| number.to_string()),
        };
        if text.contains([',', '"', '\n', '\r']) {
            format!("\"{}\"", text.replace('"', "\"\""))
        } else {
            text
        }
    }

    /// The type of its column in a schema of Parquet.
    fn kind(&self) -> [&'static str; 2] {
        match self {
            Self::Text(_) => ["BYTE_ARRAY", " (UTF8)"],
            Self::Count(_) => ["INT64", ""],
            Self::Number(_) => ["DOUBLE", ""],
        }
    }
}

/// Writes rows of these columns as a Parquet file, without compression.
///
/// # Errors
/// What the file system says.
///
/// # Panics
/// If a row has not one cell for each column, or a column has cells of two kinds.
pub(super) fn write_parquet<const N: usize>(
    names: &[&str; N],
    rows: &[[Cell; N]],
    out: &mut dyn Write,
) -> io::Result<()> {
    let file = parquet(names, rows).map_err(io::Error::other)?;
    out.write_all(&file)
}

fn parquet<const N: usize>(names: &[&str; N], rows: &[[Cell; N]]) -> Result<Vec<u8>, ParquetError> {
    let kind = |k: usize| rows.first().map_or(["DOUBLE", ""], |row| row[k].kind());
    let fields = (0..N).map(|k| {
        let [kind, note] = kind(k);
        format!("OPTIONAL {kind} {}{note};", names[k])
    });
    let fields: String = fields.collect();
    let schema = Arc::new(parse_message_type(&format!("message runs {{ {fields} }}"))?);
    let properties = Arc::new(WriterProperties::builder().build());
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, properties)?;
    let mut group = writer.next_row_group()?;
    for k in 0..N {
        let column = group.next_column()?.expect("a column for each name");
        let cells = rows.iter().map(|row| &row[k]);
        match kind(k)[0] {
            "BYTE_ARRAY" => write::<ByteArrayType>(
                column,
                cells.map(|cell| match cell {
                    Cell::Text(text) => Some(ByteArray::from(text.as_str())),
                    _ => unreachable!("a column of texts"),
                }),
            )?,
            "INT64" => write::<Int64Type>(
                column,
                cells.map(|cell| match cell {
                    Cell::Count(count) => count.and_then(|count| i64::try_from(count).ok()),
                    _ => unreachable!("a column of counts"),
                }),
            )?,
            _ => write::<DoubleType>(
                column,
                cells.map(|cell| match cell {
                    Cell::Number(number) => *number,
                    _ => unreachable!("a column of numbers"),
                }),
            )?,
        }
    }
    group.close()?;
    writer.into_inner()
}

/// Writes a column, of which some values may be missing.
fn write<T: DataType>(
    mut column: SerializedColumnWriter<'_>,
    cells: impl Iterator<Item = Option<T::T>>,
) -> Result<(), ParquetError> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    for cell in cells {
        // 1: it is there.
        levels.push(i16::from(cell.is_some()));
        values.extend(cell);
    }
    column
        .typed::<T>()
        .write_batch(&values, Some(&levels), None)?;
    column.close()
}

#[cfg(test)]
mod tests {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    use super::*;

    #[test]
    fn fields_are_quoted_where_they_must_be() {
        let field = |text: &str| Cell::Text(text.to_owned()).field();
        assert_eq!(field("a-b"), "a-b");
        assert_eq!(field("a, \"b\""), "\"a, \"\"b\"\"\"");
        assert_eq!(Cell::Count(None).field(), "");
        assert_eq!(Cell::Number(Some(0.5)).field(), "0.5");
    }

    #[test]
    fn a_file_is_read_back_with_what_is_missing() {
        let row = |name: &str, count, number| {
            [
                Cell::Text(name.to_owned()),
                Cell::Count(count),
                Cell::Number(number),
            ]
        };
        let rows = [row("a", Some(3), None), row("b, c", None, Some(0.5))];
        let file = parquet(&["name", "step", "total"], &rows).expect("a file");
        let place = tempfile::tempdir().expect("a folder").keep();
        let path = place.join("rows.parquet");
        std::fs::write(&path, file).expect("a file");
        let reader = SerializedFileReader::new(std::fs::File::open(&path).expect("a file"));
        let reader = reader.expect("Parquet");
        let rows: Vec<_> = reader.get_row_iter(None).expect("rows").collect();
        let rows: Vec<_> = rows.into_iter().map(|row| row.expect("a row")).collect();
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[0].get_string(0).expect("text"), "a");
        assert_eq!(rows[0].get_long(1).expect("a count"), 3);
        assert!(rows[0].get_double(2).is_err(), "there is none");
        assert_eq!(rows[1].get_string(0).expect("text"), "b, c");
        assert_eq!(rows[1].get_double(2).expect("a number"), 0.5);
        std::fs::remove_dir_all(place).expect("a folder");
    }
}
