//! Segments of random lengths, which differ by up to ten times: half of them fill a part of a cable of 1 m, half the rest.

use taut_measure::random::Random;

/// Where segment i of `n` begins \[m], by the seed of the lengths; the first half ends at `share`.
pub(super) fn begin(n: usize, seed: u64, share: f64, i: usize) -> f64 {
    let mut random = Random::new(seed);
    let lengths: Vec<f64> = (0..n).map(|_| random.log_uniform(0.1, 1.0)).collect();
    let (first, rest) = lengths.split_at(n / 2);
    let half = [
        (first, share, i),
        (rest, 1.0 - share, i.saturating_sub(n / 2)),
    ];
    let parts = half.map(|(part, whole, count)| {
        let filled: f64 = part.iter().take(count).sum();
        filled / part.iter().sum::<f64>() * whole
    });
    parts[0] + parts[1]
}

#[cfg(test)]
mod tests {
    use super::begin;

    #[test]
    fn random_segments_fill_the_cable() {
        let places: Vec<f64> = (0..=32).map(|i| begin(32, 7, 0.4, i)).collect();
        assert_eq!(places[0], 0.0);
        assert!((places[16] - 0.4).abs() < 1e-13 && (places[32] - 1.0).abs() < 1e-13);
        let lengths = places.windows(2).map(|pair| pair[1] - pair[0]);
        let [least, most] = [f64::min, f64::max].map(|of| lengths.clone().reduce(of).unwrap());
        let holds = least > 0.0 && (2.0..25.0).contains(&(most / least));
        assert!(holds, "{least} {most}");
    }
}
