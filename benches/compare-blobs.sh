#!/bin/sh
# Finds the same dots with this program and with OpenCV's SimpleBlobDetector, and prints times and errors of centres.
# Needs libopencv-features2d-dev (Debian), and bindings of their own: about as long to build as those that cameras need.
set -eu
cd "$(dirname "$0")/.."
OPENCV_LINK_LIBS=opencv_core,opencv_videoio,opencv_features2d,opencv_flann \
    cargo bench --no-default-features --features blobs --bench against_blobs
