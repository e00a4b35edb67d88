// The verbs that read and write images, see pulson.cpp.

#include "shell/program.hpp"
#include "shell/verbs.hpp"

int main(int argc, char** argv) { return pulson::run_program(argc, argv, pulson::add_warp_verb); }
