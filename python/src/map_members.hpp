/// Attributes of every result that has a map of landmarks.
#pragma once

#include <string>
#include <vector>

#include <pybind11/stl.h>

#include "trundle/slam/slam.hpp"

#include "views.hpp"

namespace trundle::python {

/// `map(result)`: its landmarks; `name(result, landmark)`: of one of them; `covariance(result)`: of all of
/// them together.
template <class Class, class Map, class Name, class Covariance>
void add_map(Class& bound, Map map, Name name, Covariance covariance, const char* sightings) {
  using Result = typename Class::type;
  bound
      .def_property_readonly(
          "landmarks",
          [map, name](const Result& self) {
            std::vector<std::string> names;
            for (const MappedLandmark& landmark : map(self)) names.push_back(name(self, landmark));
            return names;
          },
          "The names of the map's landmarks.")
      .def_property_readonly(
          "positions",
          [map](const py::object& self) {
            return matrices(self, map(self.cast<const Result&>()),
                            [](const MappedLandmark& row) -> const Vector2& { return row.position; });
          },
          "Of the landmarks, (n, 2) [m].")
      .def_property_readonly(
          "position_covariances",
          [map](const py::object& self) {
            return matrices(self, map(self.cast<const Result&>()),
                            [](const MappedLandmark& row) -> const Matrix2& { return row.covariance; });
          },
          "Of each landmark, (n, 2, 2) [m²].")
      .def_property_readonly(
          "map_covariance",
          [covariance](const py::object& self) { return view(self, covariance(self.cast<const Result&>())); },
          "Of all landmarks together, (2n, 2n); empty where the filter has none.")
      .def_property_readonly(
          "sightings",
          [map](const py::object& self) {
            return column(self, map(self.cast<const Result&>()),
                          [](const MappedLandmark& row) -> const std::size_t& { return row.sightings; });
          },
          sightings);
}

}  // namespace trundle::python
