#include "trundle/pipeline/umbmark_answer.hpp"

#include <fmt/format.h>

#include "trundle/calibration/squares/square_runs.hpp"
#include "trundle/io/error.hpp"

namespace trundle::pipeline {
namespace {

/// What the method works on, and what it was read from.
struct Squares {
  CalibrationResult result;
  std::vector<InputFile> files;
};

Squares from_sheet(const UmbmarkQuestion& question, const Robot& nominal) {
  const std::filesystem::path path = question.inputs.front();
  return {umbmark(read_sheet(path, question.side_m), nominal, question.method), {input_file(path)}};
}

Squares from_recordings(const UmbmarkQuestion& question, const Robot& nominal) {
  if (!question.side_m)
    throw InputError(question.inputs.front(), "is a recording, and the side of its square is not given",
                     "the nominal side that was driven");
  const std::vector<Recording> recordings = read_recordings(question.inputs);
  Squares input = {umbmark(recordings, nominal, *question.side_m, question.method), {}};
  for (const Recording& recording : recordings)
    input.files.insert(input.files.end(), recording.inputs.begin(), recording.inputs.end());
  return input;
}

Provenance provenance_of(const UmbmarkQuestion& question, const RobotFile& nominal,
                         std::vector<InputFile> files) {
  files.push_back(nominal.file);
  Provenance provenance = {.inputs = std::move(files),
                           .options = {{"method", std::string(name_of(question.method))}},
                           .seed = std::nullopt};
  if (question.side_m) provenance.options.emplace_back("side_m", fmt::format("{}", *question.side_m));
  if (!question.export_format.empty()) provenance.options.emplace_back("export", question.export_format);
  return provenance;
}

}  // namespace

bool is_sheet(const UmbmarkQuestion& question) {
  if (std::filesystem::is_directory(question.inputs.front())) return false;
  if (question.inputs.size() == 1) return true;
  throw InputError(question.inputs[1], "more than one input, the first a sheet",
                   "one sheet, or recording folders");
}

CalibrationAnswer answer_umbmark(const UmbmarkQuestion& question, const RobotFile& nominal) {
  Squares input =
      is_sheet(question) ? from_sheet(question, nominal.robot) : from_recordings(question, nominal.robot);
  CalibrationAnswer answer{provenance_of(question, nominal, std::move(input.files)), std::move(input.result)};
  add_provenance(answer.provenance, answer.result);
  return answer;
}

}  // namespace trundle::pipeline
