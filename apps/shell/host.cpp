#include "host.hpp"

#include "options.hpp"
#include "path_options.hpp"
#include "program.hpp"
#include "pulson/core/parallel.hpp"
#include "tables.hpp"

namespace pulson {
namespace {

const Host* current_host = nullptr;

}  // namespace

const Host* host() { return current_host; }

bool makes_numbers_only() { return current_host != nullptr && current_host->numbers_only; }

HostScope::HostScope(const Host& host) { current_host = &host; }
HostScope::~HostScope() { current_host = nullptr; }

void forget_run() {
  forget_path_options();
  forget_verbosity();
  forget_table_options();
}

}  // namespace pulson
