#pragma once

#include "trundle/calibration/result.hpp"

namespace trundle::test {
using namespace report;

/// What a calibration of a small differential robot looks like: three sessions of two clockwise and three
/// counter-clockwise squares each, one of them with a bump, and a winding run held out. Nothing is estimated
/// here: the numbers are those of the constructed truth.
CalibrationResult example_result();

/// The same with one parameter that the runs cannot tell.
CalibrationResult example_with_held_parameter();

/// The same with a single session.
CalibrationResult example_of_one_session();

}  // namespace trundle::test
