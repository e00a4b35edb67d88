// Sums on their way to another process of the same build: numbers as they lie in memory, lists after their lengths.

#include <cstring>
#include <type_traits>
#include <utility>

#include "pulson/core/errors.hpp"
#include "pulson/ensemble/ensemble.hpp"

namespace pulson::ensemble {

namespace {

class BytesOut {
 public:
  void raw(const void* data, std::size_t size) { bytes.append(static_cast<const char*>(data), size); }
  std::size_t length(std::size_t count, std::size_t /*item*/) {
    raw(&count, sizeof count);
    return count;
  }

  std::string bytes;
};

class BytesIn {
 public:
  explicit BytesIn(std::string_view bytes) : bytes_(bytes) {}

  void raw(void* data, std::size_t size) {
    if (size > bytes_.size()) throw InputError("the sums of an ensemble end early");
    if (size > 0) std::memcpy(data, bytes_.data(), size);
    bytes_.remove_prefix(size);
  }
  std::size_t length(std::size_t /*count*/, std::size_t item) {
    std::size_t count = 0;
    raw(&count, sizeof count);
    if (count > bytes_.size() / item) throw InputError("the sums of an ensemble end early");
    return count;
  }

 private:
  std::string_view bytes_;
};

// Each `pass` goes through a value in either direction: `Bytes` is BytesOut and the value is constant, or BytesIn.

template <class Bytes, class T>
  requires std::is_arithmetic_v<std::remove_const_t<T>>
void pass(Bytes& bytes, T& number) {
  bytes.raw(&number, sizeof number);
}

template <class Bytes, class List>
void pass_numbers(Bytes& bytes, List& list) {
  const std::size_t count = bytes.length(static_cast<std::size_t>(list.size()), sizeof(*list.data()));
  if constexpr (!std::is_const_v<List>) list.resize(count);
  bytes.raw(list.data(), count * sizeof(*list.data()));
}

template <class Bytes, class List, class PassItem>
void pass_list(Bytes& bytes, List& list, const PassItem& pass_item) {
  const std::size_t count = bytes.length(list.size(), 1);
  if constexpr (!std::is_const_v<List>) list.resize(count);
  for (auto& item : list) pass_item(item);
}

template <class Bytes, class List>
void pass_moments(Bytes& bytes, List& list) {
  pass_list(bytes, list, [&](auto& moments) {
    pass(bytes, moments.count);
    pass_numbers(bytes, moments.mean);
    pass_numbers(bytes, moments.squares);
  });
}

template <class Bytes, class Nodes>
void pass_nodes(Bytes& bytes, Nodes& nodes) {
  pass_list(bytes, nodes, [&](auto& node) {
    pass(bytes, node.first_block);
    pass(bytes, node.level);
    pass_moments(bytes, node.moments);
    pass_moments(bytes, node.pair_moments);
  });
}

/// All but the tree.
template <class Bytes, class Sums>
void pass_sums(Bytes& bytes, Sums& sums) {
  pass(bytes, sums.samples);
  for (auto* count : {&sums.paths.clean, &sums.paths.no_root, &sums.paths.momentum_bound, &sums.paths.tie,
                      &sums.crossing.at_end, &sums.crossing.ever})
    pass(bytes, *count);
  for (auto& count : sums.crossing.pairs) pass(bytes, count);
  pass(bytes, sums.momentum_error);
  pass(bytes, sums.largest_momentum);
  pass_list(bytes, sums.histograms, [&](auto& record) {
    pass_list(bytes, record, [&](auto& histogram) {
      pass(bytes, histogram.low);
      pass(bytes, histogram.high);
      pass_numbers(bytes, histogram.counts);
      pass(bytes, histogram.smallest);
      pass(bytes, histogram.largest);
    });
  });
  pass_numbers(bytes, sums.states);
}

}  // namespace

std::string bytes_of(const EnsembleSums& sums) {
  BytesOut out;
  pass_sums(out, sums);
  pass_nodes(out, sums.tree.nodes());
  return std::move(out.bytes);
}

EnsembleSums sums_of_bytes(std::string_view bytes) {
  BytesIn in(bytes);
  EnsembleSums sums;
  pass_sums(in, sums);
  std::vector<MomentNode> nodes;
  pass_nodes(in, nodes);
  for (MomentNode& node : nodes) sums.tree.add(std::move(node));
  return sums;
}

}  // namespace pulson::ensemble
