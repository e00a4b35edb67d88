// Joining and leaving the ranks, and what all of them gather.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <numeric>
#include <vector>

#include <fmt/format.h>
#include <sched.h>

#include "messages.hpp"
#include "mpi_messages.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/version.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "ranks.hpp"

namespace pulson::ranks {

namespace {

int own_threads = 0;

/// Whether the processes were started together: to start MPI alone takes longer than many a run.
bool is_started_by_mpi() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"})
    if (std::getenv(name) != nullptr) return true;
  return false;
}

/// Of each core that this rank may run on, one part for each rank of the machine that may as well.
int share_of_cores() {
  MPI_Comm machine = MPI_COMM_NULL;
  MPI_Comm_split_type(all, MPI_COMM_TYPE_SHARED, own_rank, MPI_INFO_NULL, &machine);
  int ranks_here = 1;
  MPI_Comm_size(machine, &ranks_here);
  cpu_set_t own;
  CPU_ZERO(&own);
  sched_getaffinity(0, sizeof own, &own);
  std::vector<cpu_set_t> sets(static_cast<std::size_t>(ranks_here));
  MPI_Allgather(&own, sizeof own, MPI_BYTE, sets.data(), sizeof own, MPI_BYTE, machine);
  MPI_Comm_free(&machine);
  double cores = 0;
  for (int core = 0; core < CPU_SETSIZE; ++core) {
    if (!CPU_ISSET(core, &own)) continue;
    int ranks_there = 0;
    for (const cpu_set_t& set : sets) ranks_there += CPU_ISSET(core, &set) ? 1 : 0;
    cores += 1.0 / ranks_there;
  }
  return std::max(1, static_cast<int>(cores + 1e-9));
}

void check_builds() {
  const std::string own = fmt::format("pulson {} with {}", version(), vector_target());
  std::string first = own;
  first.resize(256);
  MPI_Bcast(first.data(), static_cast<int>(first.size()), MPI_CHAR, 0, all);
  first.resize(first.find('\0'));
  if (first != own) throw InputError(fmt::format("this is {}, and rank 0 is {}: their bits differ", own, first));
}

}  // namespace

void join(int& argc, char**& argv) {
  if (!is_started_by_mpi()) return;
  int provided = MPI_THREAD_SINGLE;
  MPI_Init_thread(&argc, &argv, MPI_THREAD_SERIALIZED, &provided);
  MPI_Comm_dup(MPI_COMM_WORLD, &all);
  MPI_Comm_rank(all, &own_rank);
  MPI_Comm_size(all, &all_ranks);
  if (provided < MPI_THREAD_SERIALIZED && all_ranks > 1)
    throw InputError("this MPI lets one thread alone send and receive; several are needed");
  if (all_ranks > 1) own_threads = share_of_cores();
  check_builds();
}

int rank() { return own_rank; }
int size() { return all_ranks; }
bool are_of_mpirun() { return std::getenv("OMPI_COMM_WORLD_SIZE") != nullptr; }
int default_threads() { return own_threads; }

namespace {

/// What MPI reads and writes while ranks gather. Where one leaves before all have come, MPI still does so until it is
/// finalised: the buffers stay.
struct Gathered {
  std::string own{};
  int size = 0;
  std::vector<int> sizes{}, places{};
  std::string bytes{};
  MPI_Request request = MPI_REQUEST_NULL;
};

}  // namespace

std::string gather(std::string_view own) {
  if (all_ranks == 1) return std::string(own);
  static std::vector<std::unique_ptr<Gathered>> left;
  auto here = std::make_unique<Gathered>(
      Gathered{std::string(own), static_cast<int>(own.size()), std::vector<int>(static_cast<std::size_t>(all_ranks))});
  Pause pause;
  Patience patience;
  const auto wait = [&] {
    for (int done = 0; MPI_Test(&here->request, &done, MPI_STATUS_IGNORE) == MPI_SUCCESS && done == 0; pause.wait()) {
      if (patience.is_over()) throw Interrupted();
      const std::optional<Message> message = receive(MPI_ANY_SOURCE, kGoodbye);
      if (!message) continue;
      if (own_rank != 0) {
        is_dismissed = true;
        throw Dismissed();
      }
      hear(*message);
      if (!failure.empty()) throw InputError(failure);
    }
    pause.reset();
  };
  try {
    MPI_Iallgather(&here->size, 1, MPI_INT, here->sizes.data(), 1, MPI_INT, all, &here->request);
    wait();
    here->places.resize(here->sizes.size());
    std::exclusive_scan(here->sizes.begin(), here->sizes.end(), here->places.begin(), 0);
    here->bytes.resize(static_cast<std::size_t>(here->places.back() + here->sizes.back()));
    MPI_Iallgatherv(here->own.data(), here->size, MPI_BYTE, here->bytes.data(), here->sizes.data(), here->places.data(),
                    MPI_BYTE, all, &here->request);
    wait();
  } catch (...) {
    left.push_back(std::move(here));
    throw;
  }
  return std::move(here->bytes);
}

namespace {

/// Tells rank 0, and waits for its goodbye.
void leave_first(std::string_view error) {
  send(error, 0, kGoodbye);
  for (Pause pause; !is_dismissed; pause.wait()) is_dismissed = receive(0, kGoodbye).has_value();
}

/// Sends home all who wait or ask for work. @return whether all have gone: who is in the middle of a piece is not
/// waited for
bool dismiss_others() {
  for (int other = 1; other < all_ranks; ++other) send({}, other, kGoodbye);
  constexpr std::chrono::seconds kPatience{5};
  const Clock::time_point begin = Clock::now();
  for (Pause pause; goodbyes < all_ranks - 1;) {
    if (const std::optional<Message> message = receive(MPI_ANY_SOURCE, MPI_ANY_TAG)) {
      if (message->tag == kGoodbye) {
        hear(*message);
      } else if ((message->tag - kFirstTag) % kTagsOfRound == kQuestion) {
        Question question;
        std::memcpy(&question, message->bytes.data(), sizeof question);
        send({}, message->from, message->tag - kQuestion + kAnswer + question.slot);
      }
      pause.reset();
    } else if (Clock::now() - begin > kPatience) {
      return false;
    } else {
      pause.wait();
    }
  }
  return true;
}

}  // namespace

int leave(int exit_code, std::string_view error) {
  if (all == MPI_COMM_NULL) return exit_code;
  if (own_rank != 0) {
    leave_first(error);
    if (!error.empty()) exit_code = 0;  // rank 0 has it now
  } else if (!dismiss_others()) {
    std::fflush(nullptr);
    MPI_Abort(all, exit_code);
  }
  if (own_rank == 0 && error.empty() && exit_code == 0 && !failure.empty()) {
    print_error(failure);
    exit_code = 1;
  }
  MPI_Finalize();
  return exit_code;
}

}  // namespace pulson::ranks
