#include "trundle/pipeline/stage_runner.hpp"

#include <algorithm>
#include <tuple>

#include "trundle/report/result_files.hpp"

namespace trundle::pipeline {

bool forbids(Misread what, StageKind stage) {
  if (stage == StageKind::health_check || stage == StageKind::report) return false;
  switch (what) {
    case Misread::motion:
      return true;
    case Misread::reference:
      return stage == StageKind::calibration || stage == StageKind::evaluation;
    case Misread::other:
      return stage != StageKind::odometry && stage != StageKind::slip;
  }
  return true;
}

void StageRunner::begin(StageKind kind) const {
  if (on_progress_) on_progress_({.recording = record_.recording_name, .stage = name_of(kind)});
}

void StageRunner::require_allowed(StageKind kind) const {
  for (const Misreading& misreading : misreadings_)
    if (forbids(misreading.what, kind)) throw CannotAnswer("not done: " + misreading.words);
}

Failure StageRunner::failed(const std::exception& reason, Stage& entry) {
  entry.status = StageStatus::failed;
  entry.message = reason.what();
  return {.kind = exit_code_of(reason), .message = reason.what()};
}

void StageRunner::end(Stage entry, const std::vector<OutputFile>& files) {
  entry.outputs = save(files);
  record_.stages.push_back(std::move(entry));
  const Stage& finished = record_.stages.back();
  if (on_progress_)
    on_progress_(
        {.recording = record_.recording_name, .stage = name_of(finished.kind), .finished = &finished});
}

std::vector<std::string> StageRunner::save(const std::vector<OutputFile>& files) {
  std::vector<std::string> names;
  for (const OutputFile& file : files) {
    results_.write(file.path, file.content);
    const std::filesystem::path name = file.path.lexically_relative(inputs_.question.output);
    names.push_back(name.generic_string());
    if (kind_of(file.path, header_of(file.content)) != ResultKind::other)
      sources_.push_back(
          source_of((name.parent_path() / name.stem()).generic_string(), file.path, file.content));
  }
  return names;
}

void StageRunner::add_output(StageKind kind, const OutputFile& file) {
  const auto stage = std::ranges::find(record_.stages, kind, &Stage::kind);
  const std::vector<std::string> names = save({file});
  stage->outputs.insert(stage->outputs.end(), names.begin(), names.end());
}

OnSteps StageRunner::steps_of(StageKind kind) const {
  if (!on_progress_) return {};
  return [this, kind](std::size_t done, std::size_t of) {
    on_progress_({.recording = record_.recording_name, .stage = name_of(kind), .done = done, .of = of});
  };
}

std::vector<ResultSource> StageRunner::sources() const {
  std::vector<ResultSource> sorted = sources_;
  std::ranges::sort(sorted, [](const ResultSource& a, const ResultSource& b) {
    return std::tie(a.name, b.file.path) < std::tie(b.name, a.file.path);  // of two the .json before the .csv
  });
  return sorted;
}

}  // namespace trundle::pipeline
