#pragma once

#include <string>

#include "trundle/pipeline/localize_answer.hpp"
#include "trundle/pipeline/odometry_answer.hpp"
#include "trundle/pipeline/slam_answer.hpp"
#include "trundle/pipeline/slip_answer.hpp"

namespace trundle::pipeline {

// What a stage of `run` has found, in one line with its uncertainty.

std::string sentence_of(const IntegratedOdometry& odometry);
/// `corrected`: the odometry corrected for them.
std::string sentence_of(const SlipAnswer& answer, const IntegratedOdometry& corrected);
/// What no residual of its readings shows, said beside the slips that they do.
std::string unobservable_slip(const Robot& robot);
std::string sentence_of(const LocalizeAnswer& answer);
std::string sentence_of(const SlamAnswer& slam);

}  // namespace trundle::pipeline
