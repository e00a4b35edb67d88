// Dealing out work among the ranks: rank 0 serves the others from a thread of its own.

#include <atomic>
#include <cstring>
#include <exception>
#include <thread>

#include "mpi_messages.hpp"
#include "own_work.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "ranks.hpp"

namespace pulson::ranks {

namespace {

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

}  // namespace

void deal_bytes(const Deal& deal) {
  if (all_ranks == 1)
    OwnWork(deal).run();
  else if (own_rank == 0)
    serve_and_work(deal);
  else
    work_for_first(deal);
  ++rounds;
}

}  // namespace pulson::ranks
