// Without MPI there is one rank.

#include "ranks.hpp"

#include "own_work.hpp"

namespace pulson::ranks {

void join(int& /*argc*/, char**& /*argv*/) {}
int leave(int exit_code, std::string_view /*error*/) { return exit_code; }
int rank() { return 0; }
int size() { return 1; }
bool are_of_mpirun() { return false; }
int default_threads() { return 0; }
std::string gather(std::string_view own) { return std::string(own); }
void deal_bytes(const Deal& deal) { OwnWork(deal).run(); }

}  // namespace pulson::ranks
