#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "arrays.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/matching/registration.hpp"
#include "pulson/records/records.hpp"
#include "pulson/warp/material_flow.hpp"
#include "register/pair.hpp"

namespace pulson::python {

/// A registration with what is made of it at most once.
class Match {
 public:
  Match(matching::Registration registration, std::string record)
      : Match(std::move(registration), records::RegistrationFacts(), std::nullopt) {
    record_ = std::move(record);
  }
  /// @param facts those of match_pair() @param asked_kernel what the kernel was given as; none: it was read
  Match(matching::Registration registration, records::RegistrationFacts facts, std::optional<std::string> asked_kernel)
      : registration_(std::move(registration)),
        facts_(std::move(facts)),
        asked_kernel_(std::move(asked_kernel)),
        kernel_(make_kernel(registration_.kernel, registration_.source.points)) {}

  const matching::Registration& registration() const { return registration_; }
  const std::optional<std::string>& asked_kernel() const { return asked_kernel_; }
  const KernelOperator& kernel() const { return kernel_; }
  const records::RegistrationFacts& facts() const {
    const std::lock_guard lock(mutex_);
    return facts_locked();
  }
  /// registration.json
  const std::string& record() const {
    const std::lock_guard lock(mutex_);
    if (record_.empty()) record_ = records::registration_json(registration_, facts_locked());
    return record_;
  }

  /// Thread-safe; without the interpreter's lock.
  const warp::MaterialFlow& flow(const std::string& labels) const {
    const std::lock_guard lock(mutex_);
    require_same_kernel();
    std::unique_ptr<const warp::MaterialFlow>& flow = flows_[labels];
    if (!flow)
      flow = std::make_unique<const warp::MaterialFlow>(registration_system(registration_), path_locked(),
                                                        warp::parse_label_kernel(labels));
    return *flow;
  }

  const Trajectory& path() const {
    const std::lock_guard lock(mutex_);
    return path_locked();
  }

 private:
  const records::RegistrationFacts& facts_locked() const {
    if (!std::exchange(has_counts_, true)) facts_.counts = topology_counts(registration_);
    return facts_;
  }

  const Trajectory& path_locked() const {
    require_same_kernel();
    if (!path_) path_ = replay(registration_);
    return *path_;
  }

  // Names of kernels of one's own may have passed on.
  void require_same_kernel() const {
    const KernelOperator now = make_kernel(registration_.kernel, registration_.source.points);
    for (std::size_t i = 0; i < now.terms().size(); ++i)
      if (now.terms()[i].profile != kernel_.terms()[i].profile)
        throw InputError(
            fmt::format("the name in kernel '{}' means another kernel than when this registration was made",
                        shortened_spec(registration_.kernel)));
  }

  matching::Registration registration_;
  mutable records::RegistrationFacts facts_;
  mutable bool has_counts_ = false;
  std::optional<std::string> asked_kernel_;
  KernelOperator kernel_;
  mutable std::mutex mutex_;
  mutable std::string record_;
  mutable std::optional<Trajectory> path_;
  mutable std::map<std::string, std::unique_ptr<const warp::MaterialFlow>> flows_;
};

void add_warps(py::module_& module);

}  // namespace pulson::python
