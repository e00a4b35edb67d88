#include "mpi_messages.hpp"

#include <limits>

#include <fmt/format.h>

#include "pulson/core/errors.hpp"

namespace pulson::ranks {

namespace {

// All calls of MPI are made with this: several threads make them, one at a time.
std::mutex mpi;

}  // namespace

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

void hear(const Message& goodbye) {
  ++goodbyes;
  if (goodbye.bytes.empty() || !failure.empty()) return;
  failure = fmt::format("rank {}: {}", goodbye.from, goodbye.bytes);
}

}  // namespace pulson::ranks
