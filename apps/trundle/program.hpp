#pragma once

namespace trundle::app {

/// Does what the command line asks for, tells on stderr what went wrong, and gives the exit code.
int run_program(int argc, char** argv);

}  // namespace trundle::app
