#include "trundle/io/error.hpp"
#include "trundle/io/words.hpp"
#include "trundle/report/provenance.hpp"

#include "binding.hpp"

namespace trundle::python {
namespace {

/// The line that the program would end with: a ValueError where the input is wrong, CannotAnswer where it
/// does not suffice.
void translate_errors(py::module_& module) {
  static PyObject* cannot_answer = nullptr;
  cannot_answer = py::exception<CannotAnswer>(module, "CannotAnswer", PyExc_RuntimeError).release().ptr();
  module.attr("CannotAnswer").attr("__doc__") = "The data are well-formed, but cannot answer what was asked.";
  py::register_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const py::builtin_exception&) {
      throw;
    } catch (const py::error_already_set&) {
      throw;
    } catch (const std::exception& error) {
      const ExitCode code = exit_code_of(error);
      if (code != kBadInput && code != kCannotAnswer) throw;
      PyErr_SetString(code == kBadInput ? PyExc_ValueError : cannot_answer, one_line(error.what()).c_str());
    }
  });
}

}  // namespace
}  // namespace trundle::python

PYBIND11_MODULE(_trundle, module) {
  using namespace trundle::python;
  py::options options;
  options.disable_function_signatures();
  module.attr("__version__") = trundle::report::program_version();
  module.def("_library_s", [] { return library_s; });
  translate_errors(module);
  bind_trajectory(module);
  bind_recording(module);
  bind_robot(module);
  bind_calibration(module);
  bind_odometry(module);
  bind_slip(module);
  bind_slam(module);
  bind_merge(module);
  bind_localization(module);
  bind_evaluation(module);
  bind_run(module);
  bind_init(module);
  bind_squares(module);
  bind_live(module);
  bind_smoother(module);
}
