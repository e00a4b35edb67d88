// Verbs run in this process: by words of the command line, whose tables check them.

#include "runs.hpp"

#include <atomic>
#include <chrono>
#include <exception>
#include <map>
#include <mutex>
#include <set>
#include <thread>

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "core/step_watch.hpp"
#include "formats/held_shapes.hpp"
#include "models.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "shell/options.hpp"
#include "shell/printing.hpp"
#include "shell/program.hpp"
#include "shell/verbs.hpp"

namespace pulson::python {
namespace {

using AddVerb = std::function<void(CLI::App&, int&)>;

const std::map<std::string, AddVerb>& verbs() {
  static const std::map<std::string, AddVerb> all = {
      {"register", add_register_verb},
      {"atlas", add_atlas_verb},
      {"audit", [](CLI::App& program, int&) { add_audit_verb(program); }},
      {"warp", add_warp_verb},
      {"simulate", add_simulate_verb},
      {"ensemble", add_ensemble_verb},
      {"compare", add_compare_verb},
      {"sample", add_sample_verb},
      {"convert", [](CLI::App& program, int&) { add_convert_verb(program); }}};
  return all;
}

// The verbs have one process for themselves in the program.
std::timed_mutex& turn() {
  static std::timed_mutex mutex;
  return mutex;
}
std::atomic<std::thread::id> owner;

constexpr auto kLook = std::chrono::milliseconds(50);

// Whether the work under way is to end. Threads that shoot meanwhile see no more of it than this.
std::atomic<bool> is_stopping = false;

// Takes turns with other threads of Python, which may run meanwhile.
class Turn {
 public:
  Turn() {
    if (owner == std::this_thread::get_id() || is_in_callback())
      throw std::runtime_error("pulson is at work in this thread: it cannot be called from what it calls back");
    while (true) {
      {
        const py::gil_scoped_release others_run;
        if (turn().try_lock_for(kLook)) break;
      }
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
    owner = std::this_thread::get_id();
  }
  ~Turn() {
    owner = std::thread::id();
    turn().unlock();
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
};

// What the work says, and when it is to stop. It runs in the thread that calls, without the interpreter's lock, and
// takes that where it says how far it is or asks whether to stop, at most once in kLook: a thread of its own costs as
// much as a small match's options, task and summary together.
class Work {
 public:
  explicit Work(const RunOptions& options) : options_(options) {
    host_.numbers_only = options.numbers_only;
    host_.noise = options.noise;
    host_.message = [this](Style style, const std::string& text) {
      const std::lock_guard lock(mutex_);
      if (options_.said) (style == Style::kNote ? options_.said->notes : options_.said->warnings).push_back(text);
    };
    host_.print = [this](std::string_view text) {
      const std::lock_guard lock(mutex_);
      if (options_.said) options_.said->printed += text;
    };
    host_.progress = [this](double fraction, const std::string& text) {
      {
        const std::lock_guard lock(mutex_);
        fraction_ = fraction;
        text_ = text;
        is_new_ = true;
      }
      look_now_and_then();
    };
    host_.interrupted = [this] {
      look_now_and_then();
      return is_stopping.load();
    };
    is_stopping = false;
  }

  void run(const std::function<void()>& work) {
    std::exception_ptr failure;
    {
      const py::gil_scoped_release others_run;
      try {
        const HostScope scope(host_);
        std::optional<StepWatch> watch;  // where nothing is kept there is nothing to wait for
        if (options_.numbers_only) watch.emplace(end_soon);
        here = this;
        work();
      } catch (...) {
        failure = std::current_exception();
      }
      here = nullptr;
    }
    if (from_python_) std::rethrow_exception(from_python_);
    if (failure) std::rethrow_exception(failure);
  }

 private:
  static void end_soon() {
    if (here != nullptr) here->look_now_and_then();
    if (is_stopping) throw HostStopped();
  }

  // Other threads of the work wait for this one, which comes here itself: Python's signals are the main thread's.
  void look_now_and_then() {
    if (std::this_thread::get_id() != caller_ || is_looking_) return;
    const auto now = std::chrono::steady_clock::now();
    if (now - looked_ < kLook) return;
    is_looking_ = true;
    look();
    is_looking_ = false;
    looked_ = std::chrono::steady_clock::now();
  }

  void look() {
    std::unique_lock lock(mutex_);
    const bool shows = std::exchange(is_new_, false) && !options_.progress.is(py::none());
    const double fraction = fraction_;
    const std::string text = text_;
    lock.unlock();
    const py::gil_scoped_acquire python;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (shows && !is_stopping) options_.progress(fraction < 0 ? py::object(py::none()) : py::float_(fraction), text);
    } catch (...) {
      if (!from_python_) from_python_ = std::current_exception();
      is_stopping = true;
    }
  }

  const RunOptions& options_;
  Host host_;
  const std::thread::id caller_ = std::this_thread::get_id();
  std::chrono::steady_clock::time_point looked_ = std::chrono::steady_clock::now();
  bool is_looking_ = false;
  std::mutex mutex_;
  bool is_new_ = false;
  double fraction_ = -1;
  std::string text_;
  std::exception_ptr from_python_;
  static inline thread_local Work* here = nullptr;
};

// An option of a verb, for signatures and words.
py::dict described(const CLI::Option& option) {
  py::dict entry;
  const auto& names = option.get_lnames();
  const bool is_positional = option.get_positional();
  entry["name"] = is_positional ? option.get_name(true) : names.empty() ? std::string() : names.front();
  entry["help"] = option.get_description();
  entry["default"] = option.get_default_str();
  entry["flag"] = option.get_items_expected_max() == 0;
  entry["positional"] = is_positional;
  entry["required"] = option.get_required();
  entry["many"] = option.get_expected_max() > 1;
  entry["type"] = option.get_type_name();
  return entry;
}

py::list options_of(const std::string& verb) {
  const Turn turn;
  CLI::App program;
  int exit_code = 0;
  verbs().at(verb)(program, exit_code);
  py::list list;
  for (const CLI::Option* option : program.get_subcommand(verb)->get_options()) list.append(described(*option));
  forget_run();
  return list;
}

py::list options_of_reading() {
  const Turn turn;
  CLI::App options;
  formats::ReadOptions reading;
  add_read_options(options, reading);
  add_flip_option(options, reading);
  py::list list;
  for (const CLI::Option* option : options.get_options()) list.append(described(*option));
  forget_run();
  return list;
}

using HeldInputs = std::map<std::string, std::vector<Landmarks>>;

py::dict run_verb(const std::vector<std::string>& words, const HeldInputs& held,
                  const std::shared_ptr<const NoiseModel>& noise, py::object progress, bool numbers_only) {
  Said said;
  const int exit_code = in_host<int>(
      [&] {
        std::vector<formats::HeldShapes> inputs;
        for (const auto& [name, shapes] : held)
          inputs.emplace_back(name, formats::LandmarkFile{"npy", shapes, {}, {}, {}});
        return run_hosted_verb(words, verbs().at(words.front()));
      },
      {std::move(progress), numbers_only, &said, noise});
  py::dict result;
  result["exit_code"] = exit_code;
  result["printed"] = said.printed;
  result["warnings"] = said.warnings;
  result["notes"] = said.notes;
  return result;
}

}  // namespace

void run_hosted(const std::function<void()>& work, const RunOptions& options) {
  const Turn turn;
  Work(options).run([&] {
    struct Forgetting {
      ~Forgetting() {
        forget_run();
        set_thread_count(0);
      }
    };
    const Forgetting at_the_end;
    work();
  });
}

void add_runs(py::module_& module) {
  module.def("_options", &options_of);
  module.def("_read_options", &options_of_reading);
  module.def("_run", &run_verb, py::arg("words"), py::arg("held"), py::arg("noise"), py::arg("progress"),
             py::arg("numbers_only"));
  module.def("_build", [] { return build_facts(); });
  module.def("_formats", [] { return formats::landmark_format_names(); });
  module.def("_python_words", &in_python_words);
}

}  // namespace pulson::python
