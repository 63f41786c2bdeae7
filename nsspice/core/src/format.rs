//! Numbers as text: the shortest decimal that reads back to the same double.

/// Appends rows of `columns` numbers, separated by commas, each row ended by a line feed.
pub fn rows(values: &[f64], columns: usize, out: &mut Vec<u8>) {
    let mut buffer = ryu::Buffer::new();
    for row in values.chunks_exact(columns.max(1)) {
        for (k, &value) in row.iter().enumerate() {
            if k > 0 {
                out.push(b',');
            }
            if value.is_nan() {
                out.extend_from_slice(b"nan");
            } else if value.is_infinite() {
                out.extend_from_slice(if value > 0.0 { b"inf" } else { b"-inf" });
            } else {
                let text = buffer.format_finite(value);
                out.extend_from_slice(text.strip_suffix(".0").unwrap_or(text).as_bytes());
            }
        }
        out.push(b'\n');
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn numbers_read_back() {
        let values = [0.0, -0.0, 1.0, 0.1, 1e-7, 1.7976931348623157e308, 5e-324, 1.0 / 3.0];
        let mut out = Vec::new();
        super::rows(&values, values.len(), &mut out);
        let text = String::from_utf8(out).unwrap();
        for (part, value) in text.trim().split(',').zip(values) {
            assert_eq!(part.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{part}");
        }
        assert!(text.starts_with("0,-0,1,0.1,1e-7,"));
    }
}
