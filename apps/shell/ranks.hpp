#pragma once

#include <cstring>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace pulson::ranks {

// The processes of one run: those that mpirun or srun started together, or this one alone. Where the program was built
// without MPI there is one. Rank 0 prints and writes; the others compute. MPI is known to the files
// mpi_*.cpp alone.

/// Joins the others, once, before anything else. What ends a rank other than 0 is reported by rank 0.
/// @throws InputError where the ranks are of different builds or have different vector instructions
void join(int& argc, char**& argv);

/// Leaves the other ranks. Rank 0 waits until all are here, but not for one that is still at work. @param error what
/// ended this rank, empty where nothing did
/// @return `exit_code`, or that of a failure of another rank
int leave(int exit_code, std::string_view error);

int rank();
int size();
inline bool is_first() { return rank() == 0; }
/// Whether mpirun or its daemon of this machine started this process, and so sends the signals that end it.
bool are_of_mpirun();

/// Threads that each rank has unless others are asked for: its share of the cores that it may run on, where other ranks
/// of the same machine may run on them, too; 0, one per core, where this process is alone.
int default_threads();

/// What gather() throws where Interrupt came and others do not answer.
struct Interrupted {};

/// What gather() throws on other ranks where rank 0 has ended, and has said why.
struct Dismissed {};

/// Gathers the bytes of each rank in their order, on all ranks. Every rank must call it. @throws Interrupted, Dismissed
std::string gather(std::string_view own);

/// What is dealt out, as bytes.
struct Deal {
  std::function<std::optional<std::string>()> next;                      ///< on rank 0
  std::function<void(std::string_view piece, std::string result)> take;  ///< on rank 0
  /// On any rank, by several threads at once.
  std::function<std::string(std::string_view piece)> work;
  /// On rank 0, by several threads at once: work and then take, with nothing turned into bytes. `turn` runs what must
  /// have its turn.
  std::function<void(std::string_view piece, const std::function<void(const std::function<void()>&)>& turn)> work_here;
};

void deal_bytes(const Deal& deal);

/// Work in independent pieces. They are dealt out in order, each to whichever thread of whichever rank is free, and the
/// results come to rank 0 in any order. Calls of `next` and `take` have turns; `work` is called by several threads at
/// once. Each process makes up its own `work`, so pieces are all that travels to it.
template <class Piece, class Result>
struct Work {
  std::function<std::optional<Piece>()> next;          ///< on rank 0; nothing where all are dealt out
  std::function<Result(const Piece&)> work;            ///< on any rank
  std::function<void(const Piece&, Result)> take;      ///< on rank 0
  std::function<std::string(const Result&)> to_bytes;  ///< between processes
  std::function<Result(std::string_view)> of_bytes;
};

/// Does the work on all ranks; every rank must call it. Returns where all pieces that were dealt out are taken, or
/// after Interrupt came: then pieces that other ranks still have are left. @throws what `work` or `take` did, here or
/// there
template <class Piece, class Result>
void share(const Work<Piece, Result>& work) {
  static_assert(std::is_trivially_copyable_v<Piece>);
  const auto piece_of = [](std::string_view bytes) {
    Piece piece;
    std::memcpy(&piece, bytes.data(), sizeof piece);
    return piece;
  };
  deal_bytes({[&]() -> std::optional<std::string> {
                const std::optional<Piece> piece = work.next();
                if (!piece) return std::nullopt;
                return std::string(reinterpret_cast<const char*>(&*piece), sizeof *piece);
              },
              [&](std::string_view piece, std::string result) { work.take(piece_of(piece), work.of_bytes(result)); },
              [&](std::string_view piece) { return work.to_bytes(work.work(piece_of(piece))); },
              [&](std::string_view bytes, const auto& turn) {
                const Piece piece = piece_of(bytes);
                Result result = work.work(piece);
                turn([&] { work.take(piece, std::move(result)); });
              }});
}

}  // namespace pulson::ranks
