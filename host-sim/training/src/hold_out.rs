//! Which logs are held out of a training: those that decide when it has been long enough, and how good it is.
//!
//! *in* logs in their order; *out* logs to train on, and those held out; *never* a log in both; *source* hold-out validation, by
//! whole flights: rows of one flight are too alike to judge each other.

/// Of so many logs one is held out.
const EVERY: usize = 4;

/// Whether the log at `index` of `count` is held out: every fourth one; of fewer than four the last.
pub fn held_out(index: usize, count: usize) -> bool {
    if count < EVERY { index + 1 == count } else { index % EVERY == EVERY - 1 }
}

/// Logs to train on, and those held out, both in their order.
pub fn split<T: Copy>(logs: &[T]) -> (Vec<T>, Vec<T>) {
    let (mut training, mut validation) = (Vec::new(), Vec::new());
    for (index, log) in logs.iter().enumerate() {
        if held_out(index, logs.len()) { validation.push(*log) } else { training.push(*log) }
    }
    (training, validation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fourth_log_is_held_out_and_of_fewer_than_four_the_last() {
        let of = |count: usize| split(&(0..count).collect::<Vec<_>>());
        assert_eq!(of(0), (vec![], vec![]));
        assert_eq!(of(1), (vec![], vec![0]));
        assert_eq!(of(2), (vec![0], vec![1]));
        assert_eq!(of(3), (vec![0, 1], vec![2]));
        assert_eq!(of(4), (vec![0, 1, 2], vec![3]));
        assert_eq!(of(9), (vec![0, 1, 2, 4, 5, 6, 8], vec![3, 7]));
    }

    #[test]
    fn two_logs_or_more_leave_something_on_both_sides() {
        for count in 2..50 {
            let (training, validation) = split(&(0..count).collect::<Vec<_>>());
            assert!(!training.is_empty() && !validation.is_empty(), "{count}");
            assert_eq!(training.len() + validation.len(), count);
        }
    }
}
