#pragma once

#include "trundle/recording/csv/detail/streams.hpp"

namespace trundle::recording {

/// Puts the rows of a stream, columns as columns_of has them, into a recording: headings made continuous, and
/// what a file has in other words (places in the sensor's frame, quaternions, latitudes, angles of a gyro) as
/// the recording has it. Landmarks are read elsewhere. Throws InputError where a row lacks what it needs.
void store_stream(StreamKind kind, const StreamSource& source, Table table, Recording& recording);

}  // namespace trundle::recording
