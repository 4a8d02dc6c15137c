//! Depth cameras in a program that was built without OpenCV: refused.

use super::super::DriverError;
use super::VideoOptions;
use crate::device::DepthCamera;

/// Refuses: this program was built without the cargo feature `opencv`.
///
/// # Errors
/// [`DriverError`]: always; what is wrong with the options comes first.
pub fn open_video(options: &VideoOptions) -> Result<Box<dyn DepthCamera>, DriverError> {
    options.check()?;
    Err(DriverError::VideoAbsent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driver::VideoSource;

    #[test]
    fn cameras_are_refused_by_name_of_what_is_missing() {
        let mut options = VideoOptions::new(VideoSource::OpenNi2 { index: 0 }, [640, 480], 30.0);
        let said = |options: &VideoOptions| open_video(options).err().expect("refused").to_string();
        assert!(said(&options).contains("cargo feature `opencv`"));
        options.size = [0, 480];
        assert!(said(&options).contains("size of the depth camera is 0 × 480"));
    }
}
