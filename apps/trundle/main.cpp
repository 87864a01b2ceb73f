#include "program.hpp"

// Alone in its file: whatever includes CLI11 costs the compiler seconds, and the commands do already.
int main(int argc, char** argv) {
  return trundle::app::run_program(argc, argv);
}
