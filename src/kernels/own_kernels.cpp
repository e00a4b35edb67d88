// Kernels of one's own: their names, and sums over pairs in plain loops.

#include "own_kernels.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <mutex>
#include <shared_mutex>
#include <utility>

#include <fmt/core.h>

namespace pulson {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

// Values of KernelProfile from here on are numbers of own profiles; none is given twice.
constexpr int kFirstOwn = 1 << 16;

struct OwnKernels {
  struct Entry {
    std::string name;
    std::weak_ptr<const OwnProfile> profile;
  };
  std::shared_mutex mutex;
  std::map<int, Entry> entries;
  int next = kFirstOwn;
};

OwnKernels& own_kernels() {
  static OwnKernels all;
  return all;
}

bool is_name(const std::string& text) {
  const auto is_part = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-'; };
  return !text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) != 0 &&
         std::all_of(text.begin(), text.end(), is_part);
}

OwnKernels::Entry entry_of(KernelProfile profile) {
  OwnKernels& own = own_kernels();
  const std::shared_lock lock(own.mutex);
  const auto found = own.entries.find(static_cast<int>(profile));
  return found == own.entries.end() ? OwnKernels::Entry{"own", {}} : found->second;
}

}  // namespace

bool is_own(KernelProfile profile) { return static_cast<int>(profile) >= kFirstOwn; }

bool has_own(const std::vector<KernelTerm>& terms) {
  return std::any_of(terms.begin(), terms.end(), [](const KernelTerm& term) { return is_own(term.profile); });
}

KernelProfile name_kernel(const std::string& name, const std::shared_ptr<const OwnProfile>& profile) {
  if (!is_name(name))
    throw InputError(
        fmt::format("kernel {}: a name is a letter, and letters, digits, '_' and '-' after it", quoted_line(name)));
  for (const auto& row : kernel_table().rows())
    if (row.name == name) throw InputError(fmt::format("there is a kernel '{}' already; give another name", name));
  OwnKernels& own = own_kernels();
  const std::unique_lock lock(own.mutex);
  std::erase_if(own.entries, [](const auto& entry) { return entry.second.profile.expired(); });
  own.entries[own.next] = {name, profile};
  return static_cast<KernelProfile>(own.next++);
}

std::shared_ptr<const OwnProfile> own_profile(KernelProfile profile) {
  const OwnKernels::Entry entry = entry_of(profile);
  if (std::shared_ptr<const OwnProfile> found = entry.profile.lock()) return found;
  throw InputError(
      fmt::format("the kernel '{}' of your own exists no more; keep the object while it is used", entry.name));
}

std::string own_kernel_name(KernelProfile profile) { return entry_of(profile).name; }

std::vector<std::shared_ptr<const OwnProfile>> own_profiles(const KernelOperator& kernel) {
  std::vector<std::shared_ptr<const OwnProfile>> profiles;
  for (const KernelTerm& term : kernel.terms())
    if (is_own(term.profile)) profiles.push_back(own_profile(term.profile));
  return profiles;
}

NameTable<MakeKernelTerm> table_with_own_kernels() {
  std::vector<NameTable<MakeKernelTerm>::Row> rows = kernel_table().rows();
  const std::vector<ParameterInfo> parameters = rows.front().parameters;
  OwnKernels& own = own_kernels();
  const std::shared_lock lock(own.mutex);
  std::map<std::string, int> newest;
  for (const auto& [number, entry] : own.entries)
    if (!entry.profile.expired()) newest[entry.name] = number;
  for (const auto& [name, number] : newest)
    rows.push_back({name, parameters, "of your own", term_maker(static_cast<KernelProfile>(number))});
  return {"kernel", std::move(rows)};
}

std::vector<RadialJet> jets_of(const std::vector<KernelTerm>& terms, const ArrayXd& s, int order) {
  std::vector<RadialJet> jets(static_cast<std::size_t>(s.size()));
  for (const KernelTerm& term : terms) {
    if (!is_own(term.profile)) {
      for (Index i = 0; i < s.size(); ++i) {
        const RadialJet one = facts_of(term.profile).jet(term.alpha, s[i]);
        RadialJet& sum = jets[static_cast<std::size_t>(i)];
        sum.value += term.weight * one.value;
        sum.first += term.weight * one.first;
        sum.second += term.weight * one.second;
      }
      continue;
    }
    const double c = 1 / (term.alpha * term.alpha);
    const ProfileValues own = own_profile(term.profile)->at(c * s, order);
    for (Index i = 0; i < s.size(); ++i) {
      RadialJet& sum = jets[static_cast<std::size_t>(i)];
      sum.value += term.weight * own.value[i];
      if (order > 0) sum.first += term.weight * 2 * c * own.first[i];
      if (order > 1) sum.second += term.weight * 4 * c * c * own.second[i];
    }
  }
  return jets;
}

namespace {

int order_of(PairSum sum) {
  if (sum == PairSum::kApply) return 0;
  return sum == PairSum::kHessian || sum == PairSum::kFlowTangent ? 2 : 1;
}

bool needs_change(PairSum sum) {  // u and b
  return sum != PairSum::kApply && sum != PairSum::kApplyJacobian && sum != PairSum::kFlow;
}

bool needs_momenta(PairSum sum) {  // v
  return sum != PairSum::kApply && sum != PairSum::kApplyJacobian && sum != PairSum::kTangent;
}

template <int d>
using Vector = Eigen::Matrix<double, d, 1>;

template <int d>
Vector<d> column(const double* rows, std::size_t stride, std::size_t i, bool is_needed = true) {
  Vector<d> numbers = Vector<d>::Zero();
  for (int c = 0; is_needed && c < d; ++c) numbers[c] = rows[static_cast<std::size_t>(c) * stride + i];
  return numbers;
}

// What one target carries, and its sums: those of PairSum, row by row.
template <int d>
class PlainTarget {
 public:
  PlainTarget(const PairSumArguments& g, std::size_t i)
      : g_(g),
        i_(i),
        x_(column<d>(g.x, g.target_stride, i)),
        u_(column<d>(g.u, g.target_stride, i, needs_change(g.sum))),
        v_(column<d>(g.v, g.target_stride, i, needs_momenta(g.sum))),
        w_(column<d>(g.w, g.target_stride, i, g.sum == PairSum::kFlowTangent)) {}

  Vector<d> difference(std::size_t j) const { return x_ - column<d>(g_.y, g_.source_stride, j); }

  void add(std::size_t j, const RadialJet& k) {
    const Vector<d> z = difference(j), a = column<d>(g_.a, g_.source_stride, j);
    const Vector<d> b = column<d>(g_.b, g_.source_stride, j, needs_change(g_.sum));
    const Vector<d> change = u_ - b;
    switch (g_.sum) {
      case PairSum::kApply:
        velocity_ += k.value * a;
        break;
      case PairSum::kApplyJacobian:
        velocity_ += k.value * a;
        jacobian_ += a * (k.first * z).transpose();
        break;
      case PairSum::kTangent:
        velocity_ += k.first * z.dot(change) * a;
        break;
      case PairSum::kGradient:
        velocity_ += k.first * (u_.dot(b) + v_.dot(a)) * z;
        break;
      case PairSum::kHessian:
        velocity_ += v_.dot(a) * bend(k, z, change);
        break;
      case PairSum::kFlow:
        velocity_ += k.value * a;
        force_ += k.first * v_.dot(a) * z;
        break;
      case PairSum::kFlowTangent: {
        const Vector<d> c = column<d>(g_.c, g_.source_stride, j);
        velocity_ += k.value * c + k.first * z.dot(change) * a;
        force_ += v_.dot(a) * bend(k, z, change) + k.first * (w_.dot(a) + v_.dot(c)) * z;
        break;
      }
    }
  }

  void write() const {
    write_rows(velocity_.data(), d, 0);
    if (g_.sum == PairSum::kApplyJacobian) write_rows(jacobian_.data(), d * d, d);
    if (g_.sum == PairSum::kFlow || g_.sum == PairSum::kFlowTangent) write_rows(force_.data(), d, d);
  }

 private:
  // ∇²K along a change
  static Vector<d> bend(const RadialJet& k, const Vector<d>& z, const Vector<d>& change) {
    return k.first * change + k.second * z.dot(change) * z;
  }
  void write_rows(const double* numbers, int count, int first_row) const {
    for (int row = 0; row < count; ++row)
      g_.out[static_cast<std::size_t>(first_row + row) * g_.target_stride + i_] += numbers[row];
  }

  const PairSumArguments& g_;
  std::size_t i_;
  Vector<d> x_, u_, v_, w_;
  Vector<d> velocity_ = Vector<d>::Zero(), force_ = Vector<d>::Zero();
  Eigen::Matrix<double, d, d> jacobian_ = Eigen::Matrix<double, d, d>::Zero();
};

// So many pairs in one call of a profile: 40 MB of numbers.
constexpr std::size_t kPairsAtOnce = 1'000'000;

template <int d>
void add_plain(const PairSumArguments& g, const std::vector<KernelTerm>& terms) {
  if (g.sources == 0) return;
  const std::size_t at_once = std::max<std::size_t>(1, kPairsAtOnce / g.sources);
  for (std::size_t first = 0; first < g.targets; first += at_once) {
    const std::size_t end = std::min(first + at_once, g.targets);
    ArrayXd s(static_cast<Index>((end - first) * g.sources));
    Index pair = 0;
    for (std::size_t i = first; i < end; ++i) {
      const PlainTarget<d> target(g, i);
      for (std::size_t j = 0; j < g.sources; ++j) s[pair++] = target.difference(j).squaredNorm();
    }
    const std::vector<RadialJet> jets = jets_of(terms, s, order_of(g.sum));
    auto jet = jets.begin();
    for (std::size_t i = first; i < end; ++i) {
      PlainTarget<d> target(g, i);
      for (std::size_t j = 0; j < g.sources; ++j) target.add(j, *jet++);
      target.write();
    }
  }
}

}  // namespace

void add_plain_pair_sums(const PairSumArguments& arguments, const std::vector<KernelTerm>& terms) {
  if (arguments.dimension == 1) return add_plain<1>(arguments, terms);
  if (arguments.dimension == 2) return add_plain<2>(arguments, terms);
  add_plain<3>(arguments, terms);
}

Eigen::MatrixXd plain_gram(const std::vector<KernelTerm>& terms, const Points& x, const Points& y) {
  Eigen::ArrayXd s(x.cols() * y.cols());
  for (Eigen::Index j = 0; j < y.cols(); ++j)
    s.segment(j * x.cols(), x.cols()) = (x.colwise() - y.col(j)).colwise().squaredNorm();
  Eigen::MatrixXd matrix(x.cols(), y.cols());
  const std::vector<RadialJet> jets = jets_of(terms, s, 0);
  for (Eigen::Index i = 0; i < matrix.size(); ++i) matrix.data()[i] = jets[static_cast<std::size_t>(i)].value;
  return matrix;
}

}  // namespace pulson
