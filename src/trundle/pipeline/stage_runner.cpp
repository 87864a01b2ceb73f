#include "trundle/pipeline/stage_runner.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "trundle/io/sha256.hpp"
#include "trundle/report/result_files.hpp"

namespace trundle::pipeline {

bool forbids(Misread what, StageKind stage) {
  if (stage == StageKind::health_check || stage == StageKind::viewer_file || stage == StageKind::report)
    return false;
  switch (what) {
    case Misread::motion:
      return true;
    case Misread::wires:
      return stage != StageKind::calibration;
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
    if (file.sha256.empty()) results_.write(file.path, file.content);
    names.push_back(name_in_folder(file.path));
    if (kind_of(file.path, header_of(file.content)) == ResultKind::other) continue;
    const std::filesystem::path name = names.back();
    sources_.push_back(
        source_of((name.parent_path() / name.stem()).generic_string(), file.path, file.content));
    if (!file.sha256.empty()) sources_.back().file.sha256 = file.sha256;
  }
  return names;
}

std::string StageRunner::name_in_folder(const std::filesystem::path& path) const {
  return path.lexically_relative(inputs_.question.output).generic_string();
}

OutputFile StageRunner::write_now(OutputFile file) {
  written_now_.push_back(file.path);
  Sha256 sha;
  sha.add(file.content);
  bool is_computing = false;  // what is thrown then is no fault of the disk
  bool has_header = false;
  const auto rest = [&](const TakeText& take) {
    is_computing = true;
    file.rest([&](std::string_view piece) {
      if (!std::exchange(has_header, true)) file.content += piece.substr(0, piece.find('\n') + 1);
      sha.add(piece);
      is_computing = false;
      take(piece);
      is_computing = true;
    });
    is_computing = false;
  };
  try {
    results_.write(file.path, std::string(file.content), rest);
  } catch (const InputError& reason) {
    if (is_computing) throw;
    throw CannotWrite(reason);
  }
  file.sha256 = sha.hex();
  file.rest = {};
  return file;
}

void StageRunner::discard_written() {
  for (const std::filesystem::path& path : written_now_) results_.discard(path);
}

void StageRunner::add_copy(StageKind kind, const std::filesystem::path& of,
                           const std::filesystem::path& copy) {
  std::error_code error;
  std::filesystem::copy_file(results_.staged(of), results_.staged(copy), error);
  if (error) throw InputError(copy.string(), error.message(), "a place that can be written");
  const std::string name = name_in_folder(copy);
  std::ranges::find(record_.stages, kind, &Stage::kind)->outputs.push_back(name);
  const auto source =
      std::ranges::find_if(sources_, [&](const ResultSource& one) { return one.file.path == of.string(); });
  ResultSource same = *source;
  same.name = std::filesystem::path(name).replace_extension().generic_string();
  same.file.path = copy.string();
  sources_.push_back(std::move(same));
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

std::vector<ResultSource> StageRunner::sources_of(StageKind kind) const {
  const std::vector<std::string>& outputs = std::ranges::find(record_.stages, kind, &Stage::kind)->outputs;
  std::vector<ResultSource> found = sources();
  std::erase_if(found, [&](const ResultSource& one) {
    return std::ranges::find(outputs, name_in_folder(one.file.path)) == outputs.end();
  });
  return found;
}

}  // namespace trundle::pipeline
