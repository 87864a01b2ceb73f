#include "trundle/pipeline/provenance.hpp"

#include <nlohmann/json.hpp>

namespace trundle {

const char* word_of(Severity severity) {
  return severity == Severity::warning ? "warning" : "note";
}

nlohmann::ordered_json to_json(const Problem& problem) {
  return {{"severity", word_of(problem.severity)},
          {"kind", name_of(problem.kind)},
          {"place", problem.place},
          {"count", problem.count},
          {"message", problem.message}};
}

nlohmann::ordered_json to_json(const std::vector<Problem>& problems) {
  nlohmann::ordered_json document = nlohmann::ordered_json::array();
  for (const Problem& problem : problems) document.push_back(to_json(problem));
  return document;
}

}  // namespace trundle
