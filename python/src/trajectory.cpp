#include "trundle/geometry/trajectory.hpp"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "trundle/pipeline/evaluation_answer.hpp"
#include "trundle/recording/trajectory_file.hpp"

#include "binding.hpp"
#include "call.hpp"
#include "views.hpp"

namespace trundle::python {

void bind_trajectory(py::module_& module) {
  py::class_<Pose2>(module, "Pose", "Where a frame stands in another: x and y [m], and the heading [rad].")
      .def(py::init([](double x_m, double y_m, double heading_rad) {
             return Pose2{x_m, y_m, heading_rad};
           }),
           py::arg("x_m") = 0.0, py::arg("y_m") = 0.0, py::arg("heading_rad") = 0.0)
      .def_readonly("x_m", &Pose2::x)
      .def_readonly("y_m", &Pose2::y)
      .def_readonly("heading_rad", &Pose2::heading, "Counter-clockwise, not wrapped.")
      .def("__repr__", [](const Pose2& pose) {
        return fmt::format("Pose(x_m={}, y_m={}, heading_rad={})", pose.x, pose.y, pose.heading);
      });

  py::class_<Trajectory> trajectory(
      module, "Trajectory",
      "Poses in order of time: `time_s`, `x_m`, `y_m`, `heading_rad` and, where they are known, the\n"
      "covariances of (x, y, heading) in world axes. The arrays show the memory of the result.");
  trajectory
      .def(py::init([](const std::filesystem::path& path) {
             return by_library([&] { return read_trajectory_file(path).trajectory; });
           }),
           py::arg("path"), "Reads trajectory.csv, a .tum, or the reference of a recording.")
      .def("__len__", [](const Trajectory& self) { return self.poses.size(); })
      .def_property_readonly("time_s",
                             [](const py::object& self) {
                               return column(
                                   self, self.cast<const Trajectory&>().poses,
                                   [](const StampedPose& row) -> const double& { return row.time_s; });
                             })
      .def_property_readonly("x_m",
                             [](const py::object& self) {
                               return column(
                                   self, self.cast<const Trajectory&>().poses,
                                   [](const StampedPose& row) -> const double& { return row.pose.x; });
                             })
      .def_property_readonly("y_m",
                             [](const py::object& self) {
                               return column(
                                   self, self.cast<const Trajectory&>().poses,
                                   [](const StampedPose& row) -> const double& { return row.pose.y; });
                             })
      .def_property_readonly(
          "heading_rad",
          [](const py::object& self) {
            return column(self, self.cast<const Trajectory&>().poses,
                          [](const StampedPose& row) -> const double& { return row.pose.heading; });
          },
          "Counter-clockwise and continuous: it is not wrapped.")
      .def_property_readonly(
          "covariance",
          [](const py::object& self) -> py::object {
            const auto& poses = self.cast<const Trajectory&>();
            if (!poses.has_covariance()) return py::none();
            return matrices(self, poses.covariances,
                            [](const Matrix3& covariance) -> const Matrix3& { return covariance; });
          },
          "Of (x, y, heading) in world axes, (n, 3, 3) [m, m, rad]; None where it is not known.")
      .def("__repr__", [](const Trajectory& self) {
        if (self.poses.empty()) return std::string("<Trajectory without poses>");
        return fmt::format("<Trajectory of {} poses over {:.1f} s>", self.poses.size(),
                           self.poses.back().time_s - self.poses.front().time_s);
      });
  trajectory.def(
      "save",
      [](const Trajectory& self, const std::filesystem::path& path) {
        const bool is_tum = path.extension() == ".tum";
        const auto rows = [&](const TakeText& take) {
          is_tum ? write_tum(self, take) : write_csv(self, take);
        };
        save([&] { return std::vector<OutputFile>{{path, "", rows}}; }, {});
      },
      py::arg("path"), "Writes trajectory.csv, or a .tum by the name.");
  add_python_methods(trajectory, "A DataFrame with the columns of trajectory.csv.");
}

}  // namespace trundle::python
