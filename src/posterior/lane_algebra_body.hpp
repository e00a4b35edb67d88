// Matrices of vector lanes: products, solutions and slopes of a solution. Included once per vector target, so its guard
// toggles with the target.
#if defined(PULSON_LANE_ALGEBRA_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_LANE_ALGEBRA_BODY
#undef PULSON_LANE_ALGEBRA_BODY
#else
#define PULSON_LANE_ALGEBRA_BODY
#endif

#include <hwy/highway.h>

#include "profiles_body.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::posterior {
namespace HWY_NAMESPACE {

using namespace pulson::HWY_NAMESPACE;  // NOLINT(google-build-using-namespace): the same target's lanes

HWY_INLINE Vector At(const double* of_lanes, int i) { return hn::LoadU(Tag(), of_lanes + i * hn::Lanes(Tag())); }
HWY_INLINE void Put(Vector value, double* of_lanes, int i) {
  hn::StoreU(value, Tag(), of_lanes + i * hn::Lanes(Tag()));
}

// A tile of C += sign·A B for matrices of lanes: rows i to i + kTall, columns j to j + kWide.
template <int kTall, int kWide>
HWY_INLINE void AddTile(Vector sign, const double* a, const double* b, double* c, int m, int i, int j) {
  Vector sum[kTall][kWide];
  for (auto& row : sum)
    for (Vector& entry : row) entry = hn::Zero(Tag());
  for (int k = 0; k < m; ++k) {
    Vector of_b[kWide];
    for (int u = 0; u < kWide; ++u) of_b[u] = At(b, (j + u) * m + k);
    for (int t = 0; t < kTall; ++t) {
      const Vector of_a = At(a, k * m + i + t);
      for (int u = 0; u < kWide; ++u) sum[t][u] = hn::MulAdd(of_a, of_b[u], sum[t][u]);
    }
  }
  for (int u = 0; u < kWide; ++u)
    for (int t = 0; t < kTall; ++t)
      Put(hn::MulAdd(sign, sum[t][u], At(c, (j + u) * m + i + t)), c, (j + u) * m + i + t);
}

// C += sign·A B, column by column: A m×m, B and C m×r.
inline void AddProduct(double sign, const double* a, const double* b, double* c, int m, int r) {
  const Vector factor = Constant(sign);
  int j = 0;
  for (; j + 4 <= r; j += 4) {
    int i = 0;
    for (; i + 4 <= m; i += 4) AddTile<4, 4>(factor, a, b, c, m, i, j);
    for (; i < m; ++i) AddTile<1, 4>(factor, a, b, c, m, i, j);
  }
  for (; j < r; ++j) {
    int i = 0;
    for (; i + 4 <= m; i += 4) AddTile<4, 1>(factor, a, b, c, m, i, j);
    for (; i < m; ++i) AddTile<1, 1>(factor, a, b, c, m, i, j);
  }
}

// A tile of X −= A X': rows i to i + kTall of kWide columns, with columns `first` to `last` of A and these rows of X'.
template <int kTall, int kWide>
HWY_INLINE void SubtractTile(const double* a, const double* of, double* x, int m, int i, int first, int last) {
  Vector sum[kTall][kWide];
  for (int t = 0; t < kTall; ++t)
    for (int u = 0; u < kWide; ++u) sum[t][u] = At(x, u * m + i + t);
  for (int k = first; k < last; ++k) {
    Vector of_x[kWide];
    for (int u = 0; u < kWide; ++u) of_x[u] = At(of, u * m + k);
    for (int t = 0; t < kTall; ++t) {
      const Vector factor = At(a, k * m + i + t);
      for (int u = 0; u < kWide; ++u) sum[t][u] = hn::NegMulAdd(factor, of_x[u], sum[t][u]);
    }
  }
  for (int t = 0; t < kTall; ++t)
    for (int u = 0; u < kWide; ++u) Put(sum[t][u], x, u * m + i + t);
}

// Rows i to i + kTall of kWide columns, those before solved: L X = B.
template <int kTall, int kWide>
HWY_INLINE void SolveLowerRows(const double* a, double* x, int m, int i) {
  SubtractTile<kTall, kWide>(a, x, x, m, i, 0, i);
  for (int t = 1; t < kTall; ++t) SubtractTile<1, kWide>(a, x, x, m, i + t, i, i + t);
}

// Those after solved: U X = B, with the inverses of the pivots.
template <int kTall, int kWide>
HWY_INLINE void SolveUpperRows(const double* a, double* x, int m, int i) {
  SubtractTile<kTall, kWide>(a, x, x, m, i, i + kTall, m);
  for (int t = kTall - 1; t >= 0; --t) {
    SubtractTile<1, kWide>(a, x, x, m, i + t, i + t + 1, i + kTall);
    const Vector inverse = At(a, (i + t) * m + i + t);
    for (int u = 0; u < kWide; ++u) Put(hn::Mul(At(x, u * m + i + t), inverse), x, u * m + i + t);
  }
}

// Of kWide columns x at once; of A the factors, with the inverses of the pivots.
template <int kWide>
HWY_INLINE void SolveColumns(const double* a, double* x, int m) {
  int i = 0;
  for (; i + 4 <= m; i += 4) SolveLowerRows<4, kWide>(a, x, m, i);
  for (; i < m; ++i) SolveLowerRows<1, kWide>(a, x, m, i);
  for (; i % 4 != 0; --i) SolveUpperRows<1, kWide>(a, x, m, i - 1);
  for (; i > 0; i -= 4) SolveUpperRows<4, kWide>(a, x, m, i - 4);
}

// Rows `first` to m of kWide columns, of which those before and after `begin` have the columns begin to first of A.
template <int kWide>
HWY_INLINE void UpdateColumns(double* a, int m, int begin, int first, int j) {
  double* x = a + static_cast<std::size_t>(j) * static_cast<std::size_t>(m) * hn::Lanes(Tag());
  for (int i = begin + 1; i < first; ++i) SubtractTile<1, kWide>(a, x, x, m, i, begin, i);
  int i = first;
  for (; i + 4 <= m; i += 4) SubtractTile<4, kWide>(a, x, x, m, i, begin, first);
  for (; i < m; ++i) SubtractTile<1, kWide>(a, x, x, m, i, begin, first);
}

// LU of A m×m near the identity, so that no pivots are sought, in place, with the inverses of the pivots.
inline void Factorise(double* a, int m) {
  for (int begin = 0; begin < m; begin += 4) {
    const int next = begin + 4 < m ? begin + 4 : m;
    for (int k = begin; k < next; ++k) {
      const Vector inverse = hn::Div(Constant(1), At(a, k * m + k));
      Put(inverse, a, k * m + k);
      for (int i = k + 1; i < m; ++i) Put(hn::Mul(At(a, k * m + i), inverse), a, k * m + i);
      for (int j = k + 1; j < next; ++j) {
        const Vector top = At(a, j * m + k);
        for (int i = k + 1; i < m; ++i) Put(hn::NegMulAdd(At(a, k * m + i), top, At(a, j * m + i)), a, j * m + i);
      }
    }
    int j = next;
    for (; j + 4 <= m; j += 4) UpdateColumns<4>(a, m, begin, next, j);
    for (; j < m; ++j) UpdateColumns<1>(a, m, begin, next, j);
  }
}

// Solves A X = B in place, A m×m near the identity; A is overwritten.
inline void SolveInPlace(double* a, double* b, int m, int r) {
  Factorise(a, m);
  const std::size_t column = static_cast<std::size_t>(m) * hn::Lanes(Tag());
  int j = 0;
  for (; j + 4 <= r; j += 4) SolveColumns<4>(a, b + static_cast<std::size_t>(j) * column, m);
  for (; j < r; ++j) SolveColumns<1>(a, b + static_cast<std::size_t>(j) * column, m);
}

// A tile of S += barᵀ by, with the same `by` in all lanes.
template <int kTall, int kWide>
HWY_INLINE void AddSlopeTile(const double* bar, const double* by, double* slopes, int m, int n, int r, int c) {
  Vector sum[kTall][kWide];
  for (int t = 0; t < kTall; ++t)
    for (int u = 0; u < kWide; ++u) sum[t][u] = At(slopes, (c + u) * n + r + t);
  for (int i = 0; i < m; ++i) {
    Vector of_by[kWide];
    for (int u = 0; u < kWide; ++u) of_by[u] = Constant(by[(c + u) * m + i]);
    for (int t = 0; t < kTall; ++t) {
      const Vector of_bar = At(bar, (r + t) * m + i);
      for (int u = 0; u < kWide; ++u) sum[t][u] = hn::MulAdd(of_bar, of_by[u], sum[t][u]);
    }
  }
  for (int t = 0; t < kTall; ++t)
    for (int u = 0; u < kWide; ++u) Put(sum[t][u], slopes, (c + u) * n + r + t);
}

inline void AddSlope(const double* bar, const double* by, double* slopes, int m, int n, int columns) {
  int c = 0;
  for (; c + 4 <= columns; c += 4) {
    int r = 0;
    for (; r + 4 <= n; r += 4) AddSlopeTile<4, 4>(bar, by, slopes, m, n, r, c);
    for (; r < n; ++r) AddSlopeTile<1, 4>(bar, by, slopes, m, n, r, c);
  }
  for (; c < columns; ++c)
    for (int r = 0; r < n; ++r) AddSlopeTile<1, 1>(bar, by, slopes, m, n, r, c);
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson::posterior
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_LANE_ALGEBRA_BODY
