#pragma once

#include <span>
#include <vector>

#include "trundle/slam/association/landmark_table.hpp"
#include "trundle/slam/association/unidentified.hpp"
#include "trundle/slam/smoothing/incremental/seen_together.hpp"
#include "trundle/slam/smoothing/incremental_smoother.hpp"
#include "trundle/slam/smoothing/solver/factor_graph.hpp"

namespace trundle::slam {

/// The motion since the last keyframe, about the systematic errors that were known there.
struct SinceKeyframe {
  FreeMotion motion;
  double bias = 0.0;
  Eigen::VectorXd parameters;
  bool has_moved = false;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.motion, self.bias, self.parameters, self.has_moved);
  }
};

/// All that the incremental smoother knows.
struct IncrementalBelief {
  IncrementalBelief(const LandmarkSensor& sensor, const IncrementalSmootherOptions& chosen);

  IncrementalSmootherOptions options;
  std::vector<int> free;  ///< of the systematic errors, those that are parameters of the graph
  FactorGraph graph;      ///< a pose for each keyframe
  LandmarkTable table;    ///< of the graph's landmarks
  SeenTogether seen_together;
  std::map<LandmarkId, LandmarkId> merged_into;  ///< of duplicates that are gone, by their ids
  UnidentifiedSightings unidentified;            ///< of the step at hand
  SinceKeyframe since;
  std::vector<double> stamps;  ///< by pose [s]
  double time_s = 0.0;         ///< of the last step
  StepReport report;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.graph, self.table, self.seen_together, self.merged_into, self.since, self.stamps,
            self.time_s, self.report);
  }
};

// The step, in this order: incremental_smoother.cpp.

/// Which landmarks the sightings without an id show: the most probable explanation of all of them together.
void associate(std::span<const Observation> observations, IncrementalBelief& belief);
/// NIS of what shows landmarks of the map: the report of the observations numbered `shown`.
void gate(std::span<const std::size_t> shown, std::span<const Observation> observations,
          IncrementalBelief& belief);
/// Observation i of the step, from the last keyframe.
void add_sighting(std::size_t i, const Observation& observation, IncrementalBelief& belief);
/// Marginalises what is older than the window, and solves.
void settle(IncrementalBelief& belief);
/// Takes back what the last sightings make improbable: that two landmarks are two, or that one is there.
void revise_map(IncrementalBelief& belief);

/// The motion since the last keyframe, with a further one behind it.
[[nodiscard]] SinceKeyframe moved_on(const Motion& motion, const IncrementalBelief& belief);
/// By what is known of the systematic errors, which may have changed since the keyframe.
[[nodiscard]] Pose2 pose_now(const IncrementalBelief& belief);
[[nodiscard]] PoseEstimate estimate_of(const IncrementalBelief& belief);
/// The same, had the body moved so since the last keyframe.
[[nodiscard]] PoseEstimate estimate_of(const IncrementalBelief& belief, const SinceKeyframe& since);
/// How numbers that depend on a move of the body now depend on the last keyframe and the systematic errors.
void append_by_body(const IncrementalBelief& belief, const Eigen::MatrixXd& by_body, Eigen::Index column,
                    std::vector<EliminationTree::Derivative>& derivatives);

}  // namespace trundle::slam
