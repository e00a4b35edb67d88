#include "ranks.hpp"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <exception>
#include <mutex>

#include "messages.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

#ifdef PULSON_MPI
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <mpi.h>
#include <sched.h>

#include "pulson/core/version.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#endif

namespace pulson::ranks {

namespace {

/// Takes pieces of rank 0 until there are none, on all its threads.
class OwnWork {
 public:
  explicit OwnWork(const Deal& deal) : deal_(deal) {}

  /// For the threads of this rank and whoever serves the others, one at a time.
  std::optional<std::string> next() {
    const std::lock_guard lock(turn_);
    return stopped_ || Interrupt::came() ? std::nullopt : deal_.next();
  }
  void take(std::string_view piece, std::string result) {
    const std::lock_guard lock(turn_);
    deal_.take(piece, std::move(result));
  }
  /// Nothing more is dealt out.
  void stop() { stopped_ = true; }

  void run() {
    const auto turn = [this](const std::function<void()>& action) {
      const std::lock_guard lock(turn_);
      action();
    };
    parallel_for(thread_count(), [&](int) {
      try {
        while (const std::optional<std::string> piece = next()) deal_.work_here(*piece, turn);
      } catch (...) {
        stop();
        throw;
      }
    });
  }

 private:
  const Deal& deal_;
  std::mutex turn_;
  std::atomic<bool> stopped_ = false;
};

}  // namespace

#ifndef PULSON_MPI

void join(int& /*argc*/, char**& /*argv*/) {}
int leave(int exit_code, std::string_view /*error*/) { return exit_code; }
int rank() { return 0; }
int size() { return 1; }
bool are_of_mpirun() { return false; }
int default_threads() { return 0; }
std::string gather(std::string_view own) { return std::string(own); }
void deal_bytes(const Deal& deal) { OwnWork(deal).run(); }

#else

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// All calls of MPI are made with this: several threads make them, one at a time.
std::mutex mpi;

int own_rank = 0;
int all_ranks = 1;
int own_threads = 0;
MPI_Comm all = MPI_COMM_NULL;  // of our own
int rounds = 0;                // how often work was shared

// Tags. Each round of shared work has its own, so that a rank that is ahead is not heard too early.
constexpr int kGoodbye = 0;
constexpr int kFirstTag = 16;
constexpr int kTagsOfRound = 4096;  // a question, the end of a rank's work, and an answer to each thread
constexpr int kRounds = 4;          // whose tags differ
int tag_of_round() { return kFirstTag + kTagsOfRound * (rounds % kRounds); }
constexpr int kQuestion = 0;
constexpr int kEnd = 1;
constexpr int kAnswer = 2;

// Longer and longer pauses between looks: waiting must not take a core from those that compute.
class Pause {
 public:
  void wait() {
    std::this_thread::sleep_for(next_);
    next_ = std::min(next_ * 2, kLongest);
  }
  void reset() { next_ = kShortest; }

 private:
  static constexpr std::chrono::microseconds kShortest{20};
  static constexpr std::chrono::microseconds kLongest{1000};
  std::chrono::microseconds next_ = kShortest;
};

void complete(MPI_Request& request) {
  Pause pause;
  for (;;) {
    int done = 0;
    {
      const std::lock_guard lock(mpi);
      MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    }
    if (done != 0) return;
    pause.wait();
  }
}

void send(std::string_view bytes, int to, int tag) {
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    throw InputError(fmt::format("a result of {} bytes is too large to be sent to rank 0", bytes.size()));
  MPI_Request request = MPI_REQUEST_NULL;
  {
    const std::lock_guard lock(mpi);
    MPI_Isend(bytes.data(), static_cast<int>(bytes.size()), MPI_BYTE, to, tag, all, &request);
  }
  complete(request);
}

struct Message {
  int from = 0;
  int tag = 0;
  std::string bytes;
};

/// What has come, if anything has.
std::optional<Message> receive(int from, int tag) {
  const std::lock_guard lock(mpi);
  int came = 0;
  MPI_Status status;
  MPI_Iprobe(from, tag, all, &came, &status);
  if (came == 0) return std::nullopt;
  Message message{status.MPI_SOURCE, status.MPI_TAG, {}};
  int size = 0;
  MPI_Get_count(&status, MPI_BYTE, &size);
  message.bytes.resize(static_cast<std::size_t>(size));
  MPI_Recv(message.bytes.data(), size, MPI_BYTE, message.from, message.tag, all, MPI_STATUS_IGNORE);
  return message;
}

// On rank 0: what other ranks said at their end.
int goodbyes = 0;
std::string failure;

// On the others: whether rank 0 has said goodbye.
bool is_dismissed = false;

void hear(const Message& goodbye) {
  ++goodbyes;
  if (goodbye.bytes.empty() || !failure.empty()) return;
  failure = fmt::format("rank {}: {}", goodbye.from, goodbye.bytes);
}

/// A question: which thread asks, whether that rank was interrupted, the piece that was done before and its result.
struct Question {
  std::int32_t slot = 0;
  std::int32_t interrupted = 0;
  std::uint64_t piece_size = 0;
};

// An answer is a piece after a byte; without that there is none.
std::string answer_of(const std::optional<std::string>& piece) { return piece ? '+' + *piece : std::string(); }

/// After an interruption those that are nearly done may end; whoever started us kills us after a second or so.
class Patience {
 public:
  bool is_over() {
    constexpr milliseconds kGrace{200};
    if (!Interrupt::came()) return false;
    if (!interrupted_) interrupted_ = Clock::now();
    return Clock::now() - *interrupted_ > kGrace;
  }

 private:
  std::optional<Clock::time_point> interrupted_;
};

class Server {
 public:
  explicit Server(OwnWork& work) : work_(work) {}

  /// Until all other ranks have ended their work.
  void run() {
    Pause pause;
    while (ended_ < all_ranks - 1 && failure.empty()) {  // a rank that ended may have said goodbye by now
      if (const std::optional<Message> message = receive(MPI_ANY_SOURCE, MPI_ANY_TAG)) {
        answer(*message);
        pause.reset();
      } else {
        pause.wait();
      }
      if (patience_.is_over()) return;
    }
  }

 private:
  void answer(const Message& message) {
    if (message.tag == kGoodbye) {
      hear(message);
      if (!failure.empty()) work_.stop();
    } else if (message.tag == tag_of_round() + kEnd) {
      ++ended_;
    } else {
      Question question;
      std::memcpy(&question, message.bytes.data(), sizeof question);
      const std::string_view rest = std::string_view(message.bytes).substr(sizeof question);
      if (question.interrupted != 0) work_.stop();
      if (question.piece_size > 0)
        work_.take(rest.substr(0, question.piece_size), std::string(rest.substr(question.piece_size)));
      send(answer_of(work_.next()), message.from, tag_of_round() + kAnswer + question.slot);
    }
  }

  OwnWork& work_;
  int ended_ = 0;
  Patience patience_;
};

void serve_and_work(const Deal& deal) {
  OwnWork work(deal);
  std::exception_ptr error;
  std::thread server([&] {
    try {
      Server(work).run();
    } catch (...) {
      error = std::current_exception();
      work.stop();
    }
  });
  try {
    work.run();
  } catch (...) {
    error = std::current_exception();
  }
  server.join();
  if (error) std::rethrow_exception(error);
  if (!failure.empty()) throw InputError(failure);
}

void work_for_first(const Deal& deal) {
  const int tag = tag_of_round();
  std::atomic<bool> failed = false;
  const auto ask = [&](int slot, std::string_view piece, std::string_view result) {
    const Question question{slot, Interrupt::came() ? 1 : 0, piece.size()};
    std::string bytes(reinterpret_cast<const char*>(&question), sizeof question);
    bytes.append(piece).append(result);
    send(bytes, 0, tag + kQuestion);
    for (Pause pause;; pause.wait())
      if (std::optional<Message> message = receive(0, tag + kAnswer + slot)) return std::move(message->bytes);
  };
  parallel_for(thread_count(), [&](int slot) {
    try {
      std::string answer = ask(slot, {}, {});
      while (!answer.empty() && !failed) {
        const std::string piece = answer.substr(1);
        answer = ask(slot, piece, deal.work(piece));
      }
    } catch (...) {
      failed = true;
      throw;
    }
  });
  send({}, 0, tag + kEnd);
}

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

std::string gather(std::string_view own) {
  if (all_ranks == 1) return std::string(own);
  const int size = static_cast<int>(own.size());
  std::vector<int> sizes(static_cast<std::size_t>(all_ranks));
  MPI_Request request = MPI_REQUEST_NULL;
  Pause pause;
  Patience patience;
  const auto wait = [&] {
    for (int done = 0; MPI_Test(&request, &done, MPI_STATUS_IGNORE) == MPI_SUCCESS && done == 0; pause.wait()) {
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
  MPI_Iallgather(&size, 1, MPI_INT, sizes.data(), 1, MPI_INT, all, &request);
  wait();
  std::vector<int> places(sizes.size());
  std::exclusive_scan(sizes.begin(), sizes.end(), places.begin(), 0);
  std::string bytes(static_cast<std::size_t>(places.back() + sizes.back()), '\0');
  MPI_Iallgatherv(own.data(), size, MPI_BYTE, bytes.data(), sizes.data(), places.data(), MPI_BYTE, all, &request);
  wait();
  return bytes;
}

void deal_bytes(const Deal& deal) {
  if (all_ranks == 1)
    OwnWork(deal).run();
  else if (own_rank == 0)
    serve_and_work(deal);
  else
    work_for_first(deal);
  ++rounds;
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
  constexpr std::chrono::seconds kPatience{1};
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

#endif

}  // namespace pulson::ranks
