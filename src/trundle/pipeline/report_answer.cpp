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

}  // namespace

ReportAnswer report_of(std::vector<Results> results, const ComparedWith& with, Provenance provenance) {
  std::vector<nlohmann::ordered_json> documents;
  for (Results& result : results) {
    for (const ResultSource& source : result.sources) provenance.inputs.push_back(source.file);
    documents.push_back(result_json(std::move(result), with));
  }
  return {.provenance = provenance, .document = report_json(documents, to_json(provenance))};
}

ReportAnswer answer_report(const ReportQuestion& question) {
  Provenance provenance;
  const ComparedWith with = compared_with(question, provenance);
  std::vector<Results> results;
  for (const std::string& input : question.inputs) {
    results.push_back(read_results(input));
    if (!with.robot) results.back().robot = read_robot_used(results.back().run, input);
  }
  return report_of(std::move(results), with, std::move(provenance));
}

}  // namespace trundle::pipeline
