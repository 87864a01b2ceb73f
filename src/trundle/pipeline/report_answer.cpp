#include "trundle/pipeline/report_answer.hpp"

#include "trundle/pipeline/evaluation_answer.hpp"
#include "trundle/report/result_json.hpp"

namespace trundle::pipeline {
namespace {

ComparedWith compared_with(const ReportQuestion& question, Provenance& provenance) {
  ComparedWith with;
  if (!question.reference.empty()) {
    TrajectoryFile file = read_trajectory_file(question.reference);
    with.reference = std::move(file.trajectory);
    with.noise = file.noise;
    add_inputs(file.files, provenance);
  }
  if (!question.robot.empty()) {
    RobotFile file = read_robot_file(question.robot);
    with.robot = std::move(file.robot);
    provenance.inputs.push_back(file.file);
  }
  return with;
}

/// What the page draws of a result: much less than the result.
nlohmann::ordered_json drawn(Results result, const ComparedWith& with, std::size_t rows,
                             Provenance& provenance) {
  for (const ResultSource& source : result.sources) provenance.inputs.push_back(source.file);
  return result_json(std::move(result), with, rows);
}

}  // namespace

ReportAnswer report_of(std::vector<Results> results, const ComparedWith& with, Provenance provenance) {
  std::vector<nlohmann::ordered_json> documents;
  const std::size_t rows = rows_in_picture(results.size());
  for (Results& result : results) documents.push_back(drawn(std::move(result), with, rows, provenance));
  return {.provenance = provenance, .document = report_json(documents, to_json(provenance))};
}

ReportAnswer answer_report(const ReportQuestion& question) {
  Provenance provenance;
  const ComparedWith with = compared_with(question, provenance);
  std::vector<nlohmann::ordered_json> documents;
  for (const std::string& input : question.inputs) {
    Results result = read_results(input);
    if (!with.robot) result.robot = read_robot_used(result.run, input);
    documents.push_back(drawn(std::move(result), with, rows_in_picture(question.inputs.size()), provenance));
  }
  return {.provenance = provenance, .document = report_json(documents, to_json(provenance))};
}

}  // namespace trundle::pipeline
