//! What ended a process that did not exit by itself, in English and Vietnamese.

use std::process::ExitStatus;

use mocban_system::platform;

/// A reason why a process did not exit by itself.
#[derive(Debug)]
struct EndReason {
    /// Signals with the same numbers on Linux and macOS.
    signals: &'static [i32],
    /// Codes that Windows gives to processes that it ends (`NTSTATUS`).
    codes: &'static [u32],
    /// In English and Vietnamese.
    texts: [&'static str; 2],
    /// What may be behind it.
    perhaps: [&'static str; 2],
}

const NONE: [&str; 2] = ["", ""];

/// The program could not get memory.
const OUT_OF_MEMORY: EndReason = EndReason {
    signals: &[],
    codes: &[0xC000_0017, 0xC000_012D],
    texts: ["memory ran out", "máy đã hết bộ nhớ"],
    perhaps: NONE,
};

const REASONS: [EndReason; 6] = [
    OUT_OF_MEMORY,
    // HUP.
    EndReason {
        signals: &[1],
        codes: &[],
        texts: [
            "the session of its user ended",
            "phiên làm việc của người dùng đã kết thúc",
        ],
        perhaps: NONE,
    },
    // INT, QUIT, TERM; STATUS_CONTROL_C_EXIT.
    EndReason {
        signals: &[2, 3, 15],
        codes: &[0xC000_013A],
        texts: [
            "another program or the system stopped it",
            "chương trình khác hoặc hệ thống đã dừng tiến trình",
        ],
        perhaps: NONE,
    },
    // KILL, by which Linux frees memory.
    EndReason {
        signals: &[9],
        codes: &[],
        texts: ["it was killed", "tiến trình bị buộc dừng"],
        perhaps: [", perhaps because memory ran out", ", có thể vì hết bộ nhớ"],
    },
    // XCPU.
    EndReason {
        signals: &[24],
        codes: &[],
        texts: [
            "it used up its limit of computing time",
            "đã hết thời gian tính được cấp",
        ],
        perhaps: NONE,
    },
    // XFSZ.
    EndReason {
        signals: &[25],
        codes: &[],
        texts: [
            "a file reached the limit of its size",
            "một tệp đạt giới hạn kích thước",
        ],
        perhaps: NONE,
    },
];

/// Crashes, by ILL, TRAP, ABRT, FPE, SEGV and others.
const CRASHED: [&str; 2] = ["it crashed", "chương trình gặp sự cố"];

/// What the standard library writes before it ends a program that got no memory.
const NO_MEMORY_MESSAGE: &str = "memory allocation of ";

/// Returns what ended a process with these messages, in English and Vietnamese. `None` if it exited by itself, with a code that
/// its messages explain.
pub(super) fn reason_of_end(status: ExitStatus, messages: &str) -> Option<[String; 2]> {
    match (status.code(), platform::ending_signal(status)) {
        (Some(code), _) if code >= 0 => None,
        (Some(code), _) => Some(reason_of_code(code as u32)),
        (None, Some(signal)) => Some(reason_of_signal(signal, messages)),
        (None, None) => Some(CRASHED.map(str::to_owned)),
    }
}

/// Returns what a signal that ended a process means.
fn reason_of_signal(signal: i32, messages: &str) -> [String; 2] {
    let known = if messages.contains(NO_MEMORY_MESSAGE) {
        Some(&OUT_OF_MEMORY)
    } else {
        let mut reasons = REASONS.iter();
        reasons.find(|reason| reason.signals.contains(&signal))
    };
    explained(
        known,
        &[format!("signal {signal}"), format!("tín hiệu {signal}")],
    )
}

/// Returns what a code by which Windows ended a process means.
fn reason_of_code(code: u32) -> [String; 2] {
    let known = REASONS.iter().find(|reason| reason.codes.contains(&code));
    explained(
        known,
        &[format!("code 0x{code:08X}"), format!("mã 0x{code:08X}")],
    )
}

/// Returns a reason with the signal or code that shows it, in both languages. A reason that is not known is a crash.
fn explained(known: Option<&EndReason>, shown_by: &[String; 2]) -> [String; 2] {
    let texts = known.map_or(CRASHED, |reason| reason.texts);
    let perhaps = known.map_or(NONE, |reason| reason.perhaps);
    [0, 1].map(|i| format!("{} ({}){}", texts[i], shown_by[i], perhaps[i]))
}

#[cfg(test)]
mod tests {
    use super::{REASONS, reason_of_code, reason_of_signal};

    #[test]
    fn a_signal_is_explained_in_both_languages() {
        for (signal, messages, expected) in [
            (
                9,
                "aligning",
                [
                    "it was killed (signal 9), perhaps because memory ran out",
                    "tiến trình bị buộc dừng (tín hiệu 9), có thể vì hết bộ nhớ",
                ],
            ),
            (
                11,
                "",
                [
                    "it crashed (signal 11)",
                    "chương trình gặp sự cố (tín hiệu 11)",
                ],
            ),
            (
                15,
                "",
                [
                    "another program or the system stopped it (signal 15)",
                    "chương trình khác hoặc hệ thống đã dừng tiến trình (tín hiệu 15)",
                ],
            ),
            (
                6,
                "memory allocation of 8589934592 bytes failed\n",
                [
                    "memory ran out (signal 6)",
                    "máy đã hết bộ nhớ (tín hiệu 6)",
                ],
            ),
        ] {
            assert_eq!(reason_of_signal(signal, messages), expected);
        }
    }

    #[test]
    fn a_code_of_windows_is_explained_in_both_languages() {
        assert_eq!(
            reason_of_code(0xC000_0005),
            [
                "it crashed (code 0xC0000005)",
                "chương trình gặp sự cố (mã 0xC0000005)"
            ]
        );
        assert_eq!(
            reason_of_code(0xC000_0017),
            [
                "memory ran out (code 0xC0000017)",
                "máy đã hết bộ nhớ (mã 0xC0000017)"
            ]
        );
    }

    #[test]
    fn a_signal_has_one_reason() {
        let signals = REASONS.iter().flat_map(|reason| reason.signals);
        let mut signals: Vec<i32> = signals.copied().collect();
        signals.sort_unstable();
        let count = signals.len();
        signals.dedup();
        assert_eq!(signals.len(), count);
    }
}
