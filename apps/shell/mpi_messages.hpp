#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include <mpi.h>

#include "messages.hpp"

namespace pulson::ranks {

// What the files that know MPI share.

using Clock = std::chrono::steady_clock;

inline int own_rank = 0;
inline int all_ranks = 1;
inline MPI_Comm all = MPI_COMM_NULL;  // of our own
inline int rounds = 0;                // how often work was shared

// Tags. Each round of shared work has its own, so that a rank that is ahead is not heard too early.
inline constexpr int kGoodbye = 0;
inline constexpr int kFirstTag = 16;
inline constexpr int kTagsOfRound = 4096;  // a question, the end of a rank's work, and an answer to each thread
inline constexpr int kRounds = 4;          // whose tags differ
inline int tag_of_round() { return kFirstTag + kTagsOfRound * (rounds % kRounds); }
inline constexpr int kQuestion = 0;
inline constexpr int kEnd = 1;
inline constexpr int kAnswer = 2;

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

/// Waits until it is.
void complete(MPI_Request& request);

/// @throws InputError where it is larger than a message may be
void send(std::string_view bytes, int to, int tag);

struct Message {
  int from = 0;
  int tag = 0;
  std::string bytes;
};

/// What has come, if anything has.
std::optional<Message> receive(int from, int tag);

// On rank 0: what other ranks said at their end.
inline int goodbyes = 0;
inline std::string failure;

// On the others: whether rank 0 has said goodbye.
inline bool is_dismissed = false;

/// On rank 0, of a goodbye.
void hear(const Message& goodbye);

/// A question: which thread asks, whether that rank was interrupted, the piece that was done before and its result.
struct Question {
  std::int32_t slot = 0;
  std::int32_t interrupted = 0;
  std::uint64_t piece_size = 0;
};

// An answer is a piece after a byte; without that there is none.
inline std::string answer_of(const std::optional<std::string>& piece) { return piece ? '+' + *piece : std::string(); }

/// After an interruption those that are nearly done may end; whoever started us kills us after a second or so.
class Patience {
 public:
  bool is_over() {
    constexpr std::chrono::milliseconds kGrace{200};
    if (!Interrupt::came()) return false;
    if (!interrupted_) interrupted_ = Clock::now();
    return Clock::now() - *interrupted_ > kGrace;
  }

 private:
  std::optional<Clock::time_point> interrupted_;
};

}  // namespace pulson::ranks
