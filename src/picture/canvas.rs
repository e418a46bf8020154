//! Pixels in rows, and PNG.

use png::{BitDepth, ColorType, Encoder, EncodingError};

/// A picture in RGB, 8 bits to a colour.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Canvas {
    width: usize,
    pixels: Vec<[u8; 3]>,
}

impl Canvas {
    /// All of one colour.
    pub(super) fn new(width: usize, height: usize, colour: [u8; 3]) -> Self {
        Self {
            width,
            pixels: vec![colour; width * height],
        }
    }

    /// Sets a pixel, counted from the upper left.
    ///
    /// # Panics
    /// If it lies outside.
    pub(super) fn put(&mut self, x: usize, y: usize, colour: [u8; 3]) {
        assert!(x < self.width, "column {x} of {}", self.width);
        self.pixels[y * self.width + x] = colour;
    }

    /// Pixels from left to right, and from top to bottom.
    pub(super) fn size(&self) -> [usize; 2] {
        [self.width, self.pixels.len() / self.width]
    }

    /// The colours of all pixels, row by row.
    pub(super) fn bytes(&self) -> &[u8] {
        self.pixels.as_flattened()
    }

    /// The picture as a PNG file.
    pub(super) fn png(&self) -> Result<Vec<u8>, EncodingError> {
        let mut bytes = Vec::new();
        let height = self.pixels.len() / self.width;
        let mut encoder = Encoder::new(&mut bytes, self.width as u32, height as u32);
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        writer.finish()?;
        Ok(bytes)
    }
}

#[cfg(test)]
impl Canvas {
    /// What a PNG file holds.
    pub(super) fn read(path: &std::path::Path) -> Self {
        let file = std::io::BufReader::new(std::fs::File::open(path).expect("a file"));
        let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
        let mut bytes = vec![0; reader.output_buffer_size().expect("a size that fits")];
        let info = reader.next_frame(&mut bytes).expect("whole pixels");
        Self {
            width: info.width as usize,
            pixels: bytes.as_chunks::<3>().0.to_vec(),
        }
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn height(&self) -> usize {
        self.pixels.len() / self.width
    }

    pub(super) fn get(&self, x: usize, y: usize) -> [u8; 3] {
        self.pixels[y * self.width + x]
    }
}
