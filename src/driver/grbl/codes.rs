//! What a code of Grbl means, and whether the position can be trusted after an alarm.
//!
//! Sources: gnea/grbl, doc/csv/alarm_codes_en_US.csv and error_codes_en_US.csv; grblHAL, alarms.h and errors.h for the codes above
//! what Grbl has.

/// Code of a fault that the controller has no number for: stopped on request, held, or in alarm without saying why.
pub(super) const NO_CODE: u8 = 0;
/// grblHAL: locked until it has homed.
pub(super) const HOMING_REQUIRED: u8 = 11;
/// grblHAL: stands on a limit switch, and may home but nothing else.
pub(super) const LIMIT_CLOSED: u8 = 12;
/// Errors of grblHAL that say the same when it is to be unlocked.
pub(super) const ONLY_HOMING: [u8; 2] = [45, 46];

/// What an alarm means, for people.
pub(super) fn alarm(code: u8) -> &'static str {
    match code {
        NO_CODE => "it was stopped, or is held or in alarm without saying why",
        1 => "a limit switch was hit; it stopped dead, so that steps may be lost",
        2 => "the target of a motion lies outside its travel; it has kept its position",
        3 => "reset while in motion; it stopped dead, so that steps may be lost",
        4 => "the probe was not in the state that probing starts from",
        5 => "the probe did not touch anything within its travel",
        6 => "reset while homing",
        7 => "stopped while homing",
        8 => "the limit switch did not open when homing pulled off it",
        9 => "homing did not find a limit switch",
        10 => "emergency stop, or homing did not find a second switch",
        HOMING_REQUIRED => "it has to home first",
        LIMIT_CLOSED => "a limit switch is closed",
        14 => "the spindle did not reach its speed",
        15 => "homing did not find the second switch of a squared axis",
        16 => "its self-test failed",
        17 => "a motor driver reports a fault",
        18 => "its homing is not configured",
        _ => "an alarm that this program has no text for",
    }
}

/// Whether a homed stage still knows where it is after an alarm. Only causes that stop it by decelerating, or do not move it at all,
/// leave the position sound; for an unknown one it is taken for lost.
pub(super) fn keeps_position(alarm: u8) -> bool {
    matches!(alarm, 2 | 4 | 5)
}

/// What an error means, for people.
pub(super) fn error(code: u8) -> &'static str {
    match code {
        1 | 2 | 20..=28 | 30..=38 => "it does not understand the line (garbled on the way?)",
        3 => "it does not know this command",
        5 => "homing is not enabled ($22)",
        7 => "its settings could not be read and were replaced by defaults",
        8 => "it takes this command only while idle",
        9 => "it is locked by an alarm",
        10 => "soft limits need homing ($22)",
        11 | 14 => "the line is too long for it",
        13 => "its safety door is open",
        15 => "the target lies outside the travel that it knows of",
        16 => "it takes this for no valid jog",
        18 => "it is being reset",
        29 => "it does not have this coordinate system",
        45 => "a limit switch is closed: only homing is allowed",
        46 => "it has to home first",
        49 => "its self-test failed",
        50 => "its emergency stop is active",
        51 => "a motor driver reports a fault",
        79 => "it has to be reset first",
        _ => "an error that this program has no text for",
    }
}
