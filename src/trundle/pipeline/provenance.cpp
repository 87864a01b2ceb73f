#include "trundle/pipeline/provenance.hpp"

#include <nlohmann/json.hpp>

namespace trundle::pipeline {

const char* word_of(Severity severity) {
  return severity == Severity::warning ? "warning" : "note";
}

nlohmann::ordered_json to_json(const Finding& problem) {
  return {{"severity", word_of(problem.severity)},
          {"kind", name_of(problem.code)},
          {"place", problem.place},
          {"count", problem.count},
          {"message", describe(problem)}};
}

nlohmann::ordered_json to_json(const std::vector<Finding>& findings) {
  nlohmann::ordered_json document = nlohmann::ordered_json::array();
  for (const Finding& problem : findings) document.push_back(to_json(problem));
  return document;
}

}  // namespace trundle::pipeline
