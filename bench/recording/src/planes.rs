//! Numbers of many frames in few bytes: what a channel is expected to be is taken off, and bytes of equal weight stand
//! together.
//!
//! A channel is a sequence of 32-bit integers x₀, x₁, …, one a frame: the bits of a single-precision number, or counts of a
//! step. Its difference of order 0, 1 or 2, whichever has the fewest bits, is kept modulo 2³²,
//!
//! ```text
//! d_k = x_k        d_k = x_k − x_{k−1}        d_k = x_k − 2 x_{k−1} + x_{k−2}        x_{−1} = x_{−2} = 0
//! ```
//!
//! as z = 2d or −2d − 1, so that small differences of either sign have leading zeros. The bytes are: the order of each
//! channel; then the lowest byte of every z, channel by channel; then the next byte of all; and so on, four times. Deflate
//! finds the rest.

/// Most frames times channels of a block.
pub(crate) const MOST: usize = 1 << 24;

fn expected(order: u8, last: i32, before: i32) -> i32 {
    match order {
        0 => 0,
        1 => last,
        _ => last.wrapping_mul(2).wrapping_sub(before),
    }
}

fn differences(
    values: &[i32],
    width: usize,
    channel: usize,
    order: u8,
) -> impl Iterator<Item = u32> {
    let (mut last, mut before) = (0, 0);
    values.iter().skip(channel).step_by(width).map(move |x| {
        let d = x.wrapping_sub(expected(order, last, before));
        (before, last) = (last, *x);
        ((d << 1) ^ (d >> 31)) as u32
    })
}

/// The bytes of `values`, frame by frame `width` of them.
pub(crate) fn encode(values: &[i32], width: usize) -> Vec<u8> {
    if width == 0 {
        return Vec::new();
    }
    let bits = |channel: usize, order: u8| -> u32 {
        let all = differences(values, width, channel, order);
        all.map(|z| u32::BITS - z.leading_zeros()).sum()
    };
    let orders = (0..width).map(|channel| (0..3).min_by_key(|order| bits(channel, *order)));
    let mut bytes: Vec<u8> = orders.map(Option::unwrap_or_default).collect();
    for weight in 0..4 {
        for channel in 0..width {
            let order = bytes[channel];
            let all = differences(values, width, channel, order);
            bytes.extend(all.map(|z| z.to_le_bytes()[weight]));
        }
    }
    bytes
}

/// Inverse of [`encode`]: the values, and the number of bytes read. `None` if there are too few
/// bytes or more than [`MOST`] values.
pub(crate) fn decode(bytes: &[u8], width: usize, frames: usize) -> Option<(Vec<i32>, usize)> {
    let count = width.checked_mul(frames).filter(|count| *count <= MOST)?;
    let used = width + 4 * count;
    let (orders, planes) = bytes.get(..used)?.split_at(width);
    let mut values = vec![0; count];
    for (channel, order) in orders.iter().enumerate() {
        let (mut last, mut before) = (0_i32, 0);
        for frame in 0..frames {
            let at = channel * frames + frame;
            let z = u32::from_le_bytes([0, 1, 2, 3].map(|weight| planes[weight * count + at]));
            let d = (z >> 1) as i32 ^ -((z & 1) as i32);
            let x = d.wrapping_add(expected(*order, last, before));
            (before, last) = (last, x);
            values[frame * width + channel] = x;
        }
    }
    Some((values, used))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_encoded_is_decoded() {
        let smooth = |k: i32| (0.001 * f64::from(k)).sin() as f32;
        let frames = 200;
        let values: Vec<i32> = (0..frames)
            .flat_map(|k| {
                [
                    smooth(k).to_bits() as i32,
                    k * 7,
                    i32::MIN + k,
                    -1,
                    1 << (k % 31),
                ]
            })
            .collect();
        let bytes = encode(&values, 5);
        assert_eq!(bytes.len(), 5 + 4 * values.len());
        let decoded = decode(&bytes, 5, frames as usize);
        assert_eq!(decoded, Some((values, bytes.len())));
        assert_eq!(decode(&bytes[1..], 5, frames as usize), None);
        assert_eq!(decode(&bytes, usize::MAX, 2), None);
        assert_eq!(decode(&[], 0, 3), Some((Vec::new(), 0)));
        // A straight line has no second difference, a constant no first one.
        assert_eq!(bytes[1..4], [2, 2, 1]);
    }
}
