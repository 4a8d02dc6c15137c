//! What can be wrong with a proof.

use std::io;
use std::path::PathBuf;

/// Why a proof cannot be made, or does not hold.
#[derive(Debug, thiserror::Error)]
pub(in crate::cli) enum ProofError {
    #[error("{} is not empty and holds no concealed draws; choose another place", place.display())]
    Taken { place: PathBuf },
    #[error("{} holds no concealed draws: there is no {}", place.display(), file)]
    NoDraws { place: PathBuf, file: &'static str },
    #[error("{} holds no {draw}; expected one of {}", place.display(), known)]
    NoSuchDraw { place: PathBuf, draw: String, known: String },
    #[error("{} was made from another seed", place.display())]
    OtherSeed { place: PathBuf },
    #[error("{} was made with --phantoms {has}, asked for are {asked}", place.display())]
    OtherPhantoms { place: PathBuf, has: u64, asked: u64 },
    #[error("{} was made with another choice of --with-effect", place.display())]
    OtherKind { place: PathBuf },
    #[error("{draw} has no {what}: run `phantom-rig conceal` again to its end")]
    Incomplete { draw: String, what: &'static str },
    #[error("the diagnosis of {draw} was ended from outside; run again to go on")]
    Ended { draw: String },
    #[error("the verdict of {draw} is missing although the verdicts are closed")]
    MissingVerdict { draw: String },
    #[error("the verdict of {draw} was changed after the verdicts were closed")]
    ChangedVerdict { draw: String },
    #[error("the verdict of {draw} is none: {why}")]
    NotAVerdict { draw: String, why: String },
    #[error("the verdict of {draw} was made {how} --quick: one proof does not hold both kinds")]
    OtherHaste { draw: String, how: &'static str },
    #[error("the verdicts are closed; the answers stay sealed, for there is no key at {}", place.display())]
    NoKey { place: PathBuf },
    #[error("{} holds no key", place.display())]
    NotAKey { place: PathBuf },
    #[error("the answer of {draw} does not open: it was changed, or the key is another's")]
    Sealed { draw: String },
    #[error("the answer of {draw} is not the one whose hash was published")]
    OtherAnswer { draw: String },
    #[error("the recording of {draw} is not the one that its answer belongs to")]
    OtherRecording { draw: String },
    #[error("the answer of {draw} cannot be read")]
    NotAnAnswer { draw: String, source: serde_json::Error },
    #[error("{}: can't be {action}", place.display())]
    System { place: PathBuf, action: &'static str, source: io::Error },
    #[error("{}: not what it should be", place.display())]
    Json { place: PathBuf, source: serde_json::Error },
    #[error("{}: not the table that it should be", place.display())]
    Table { place: PathBuf, source: csv::Error },
}
