// Compiled once per vector target by foreach_target.h; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "symmetric_matrix.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
#include "symmetric_matrix.hpp"
// clang-format on

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::ScalableTag<double>;
using Vector = hn::Vec<Tag>;

// Columns of the matrix that are read together: more would not find registers in AVX2.
constexpr int kPanel = 2;

HWY_INLINE double Sum(Vector v) { return hn::GetLane(hn::SumOfLanes(Tag(), v)); }

// dots[c][v] += Σ_i a_c[i] x_v[i], and with kBoth y_v[i] += Σ_c a_c[i] factors[c][v], over `count` rows.
template <int m, bool kDots, bool kAxpys>
HWY_INLINE void Panel(const double* const* a, std::size_t count, const double* x, double* y, std::size_t stride,
                      const double (*factors)[m], double (*dots)[m]) {
  const std::size_t lanes = hn::Lanes(Tag());
  Vector sums[kPanel][m], f[kPanel][m];
  for (int c = 0; c < kPanel; ++c)
    for (int v = 0; v < m; ++v) {
      sums[c][v] = hn::Zero(Tag());
      f[c][v] = hn::Set(Tag(), kAxpys ? factors[c][v] : 0.0);
    }
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    Vector of_a[kPanel];
    for (int c = 0; c < kPanel; ++c) of_a[c] = hn::LoadU(Tag(), a[c] + i);
    for (int v = 0; v < m; ++v) {
      if (kDots) {
        const Vector of_x = hn::LoadU(Tag(), x + v * stride + i);
        for (int c = 0; c < kPanel; ++c) sums[c][v] = hn::MulAdd(of_a[c], of_x, sums[c][v]);
      }
      if (kAxpys) {
        Vector of_y = hn::LoadU(Tag(), y + v * stride + i);
        for (int c = 0; c < kPanel; ++c) of_y = hn::MulAdd(of_a[c], f[c][v], of_y);
        hn::StoreU(of_y, Tag(), y + v * stride + i);
      }
    }
  }
  for (int c = 0; c < kPanel; ++c)
    for (int v = 0; v < m; ++v) {
      if (kDots) dots[c][v] = Sum(sums[c][v]);
      for (std::size_t rest = i; rest < count; ++rest) {
        if (kDots) dots[c][v] += a[c][rest] * x[v * stride + rest];
        if (kAxpys) y[v * stride + rest] += a[c][rest] * factors[c][v];
      }
    }
}

// y += (A − diag A)x, A above the diagonal of the matrix.
template <int m>
void AddProduct(const ThinProduct& g) {
  const std::size_t n = g.size;
  for (std::size_t j = 0; j < n; j += kPanel) {
    const std::size_t width = j + kPanel <= n ? kPanel : n - j;
    const double* a[kPanel];
    double factors[kPanel][m], dots[kPanel][m];
    for (std::size_t c = 0; c < kPanel; ++c) {
      a[c] = g.matrix + (j + (c < width ? c : 0)) * g.stride;
      for (int v = 0; v < m; ++v) factors[c][v] = c < width ? g.x[v * n + j + c] : 0;
    }
    Panel<m, true, true>(a, j, g.x, g.y, n, factors, dots);
    for (int v = 0; v < m; ++v) {
      for (std::size_t c = 0; c < width; ++c) g.y[v * n + j + c] += dots[c][v];
      for (std::size_t c = 1; c < width; ++c)
        for (std::size_t r = 0; r < c; ++r) {
          g.y[v * n + j + r] += a[c][j + r] * factors[c][v];
          g.y[v * n + j + c] += a[c][j + r] * factors[r][v];
        }
    }
  }
}

// y := L⁻¹y.
template <int m>
void SolveForwards(const ThinProduct& g) {
  const std::size_t n = g.size;
  for (std::size_t j = 0; j < n; j += kPanel) {
    const std::size_t width = j + kPanel <= n ? kPanel : n - j;
    const double* a[kPanel];
    double factors[kPanel][m] = {};
    for (std::size_t c = 0; c < kPanel; ++c) a[c] = g.matrix + (j + (c < width ? c : 0)) * g.stride;
    for (int v = 0; v < m; ++v)
      for (std::size_t c = 0; c < width; ++c) {
        double& value = g.y[v * n + j + c];
        for (std::size_t r = 0; r < c; ++r) value += a[r][j + c] * factors[r][v];
        value /= a[c][j + c];
        factors[c][v] = -value;
      }
    const std::size_t below = j + width;
    for (const double*& column : a) column += below;
    Panel<m, false, true>(a, n - below, nullptr, g.y + below, n, factors, nullptr);
  }
}

// y := L⁻ᵀy.
template <int m>
void SolveBackwards(const ThinProduct& g) {
  const std::size_t n = g.size;
  for (std::size_t end = n; end > 0;) {
    const std::size_t width = end % kPanel == 0 ? kPanel : end % kPanel;
    const std::size_t j = end - width;
    const double* a[kPanel];
    double dots[kPanel][m];
    for (std::size_t c = 0; c < kPanel; ++c) a[c] = g.matrix + (j + (c < width ? c : 0)) * g.stride + end;
    Panel<m, true, false>(a, n - end, g.y + end, nullptr, n, nullptr, dots);
    for (int v = 0; v < m; ++v)
      for (std::size_t c = width; c-- > 0;) {
        const double* column = g.matrix + (j + c) * g.stride + j;
        double& value = g.y[v * n + j + c];
        value -= dots[c][v];
        for (std::size_t r = c + 1; r < width; ++r) value -= column[r] * g.y[v * n + j + r];
        value /= column[c];
      }
    end = j;
  }
}

void AddProductOf(const ThinProduct& g) {
  if (g.columns == 1) return AddProduct<1>(g);
  return g.columns == 2 ? AddProduct<2>(g) : AddProduct<3>(g);
}

template <int m>
void Solve(const ThinProduct& g) {
  SolveForwards<m>(g);
  SolveBackwards<m>(g);
}

void SolveOf(const ThinProduct& g) {
  if (g.columns == 1) return Solve<1>(g);
  return g.columns == 2 ? Solve<2>(g) : Solve<3>(g);
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#if HWY_ONCE

#include <algorithm>

#include "core/text.hpp"

// LAPACK's; OpenBLAS has it, but no header that declares it without LAPACKE.
// NOLINTNEXTLINE(readability-identifier-naming): Fortran's
extern "C" void dpotrf_(const char* triangle, const int* n, double* a, const int* stride, int* info,
                        std::size_t triangle_length);

namespace pulson {

HWY_EXPORT(AddProductOf);
HWY_EXPORT(SolveOf);

namespace {

constexpr Eigen::Index kMostColumns = 3;  // of one pass over the matrix

ThinProduct columns_of(const Eigen::MatrixXd& matrix, const double* x, double* y, Eigen::Index columns) {
  return {matrix.data(),
          static_cast<std::size_t>(matrix.outerStride()),
          static_cast<std::size_t>(matrix.rows()),
          x,
          y,
          static_cast<int>(columns)};
}

}  // namespace

bool factorise_in_place(Eigen::MatrixXd& matrix) {
  const int n = static_cast<int>(matrix.rows());
  int info = 0;
  if (n > 0) dpotrf_("L", &n, matrix.data(), &n, &info, 1);
  return info == 0;
}

Eigen::MatrixXd symmetric_product(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& diagonal,
                                  const Eigen::MatrixXd& x) {
  require_size("the factor of a symmetric matrix", x, matrix.rows(), x.cols());
  Eigen::MatrixXd y = diagonal.asDiagonal() * x;
  for (Eigen::Index first = 0; first < x.cols(); first += kMostColumns) {
    const Eigen::Index columns = std::min(kMostColumns, x.cols() - first);
    HWY_DYNAMIC_DISPATCH(AddProductOf)(columns_of(matrix, x.col(first).data(), y.col(first).data(), columns));
  }
  return y;
}

void solve_factorised(const Eigen::MatrixXd& matrix, Eigen::MatrixXd& x) {
  require_size("the right-hand side of a system", x, matrix.rows(), x.cols());
  for (Eigen::Index first = 0; first < x.cols(); first += kMostColumns) {
    const Eigen::Index columns = std::min(kMostColumns, x.cols() - first);
    HWY_DYNAMIC_DISPATCH(SolveOf)(columns_of(matrix, nullptr, x.col(first).data(), columns));
  }
}

}  // namespace pulson

#endif  // HWY_ONCE
