#include "trundle/pipeline/report_answer.hpp"

#include "trundle/pipeline/evaluation_answer.hpp"
#include "trundle/report/result_json.hpp"

namespace trundle {
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

ReportAnswer answer_report(const ReportQuestion& question) {
  ReportAnswer answer;
  const ComparedWith with = compared_with(question, answer.provenance);
  std::vector<nlohmann::ordered_json> results;
  for (const std::string& input : question.inputs) {
    results.push_back(read_result(input, with));
    for (const auto& source : results.back().at("sources"))
      answer.provenance.inputs.push_back({source.at("path"), source.at("sha256")});
  }
  answer.document = report_json(results, to_json(answer.provenance));
  return answer;
}

}  // namespace trundle
