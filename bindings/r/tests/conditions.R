# Errors, warnings and notes of the program, with its words.
source("helpers.R")

a <- leaves[, , 1]
b <- leaves[, , 2]
fails(pulson_register(a, b, kernal = "auto"), "pulson_input_error", "unknown option 'kernal'; did you mean 'kernel'")
fails(pulson_register(a, b[1:7, ]), "pulson_input_error", "19", "7")
fails(pulson_register(a, b, "ch-sd"), "pulson_input_error", "has no name")
fails(pulson_register(a, b, json = "x"), "pulson_input_error", "json is set by this package")
fails(pulson_register(a, b, sigma = NA), "pulson_input_error", "sigma")
fails(pulson_register(a, b, sigma = list(1)), "pulson_input_error", "sigma")
fails(pulson_register(leaves, b), "pulson_input_error", "source has 8 shapes; choose one, as source[, , 1]")
fails(pulson_warp(1, a), "pulson_input_error", "pulson_register()")
fails(pulson_mode(1), "pulson_input_error", "pulson_atlas()")
# Files in messages are called after arguments, not after folders that are gone.
message <- tryCatch(pulson_register(a, b[1:7, ]), error = conditionMessage)
stopifnot(!grepl(tempdir(), message, fixed = TRUE))

# Switches are TRUE or FALSE, other options have values, and each is told from the other before the program runs.
fails(pulson_register(a, b, align = FALSE), "pulson_input_error", "align: it is no switch, and FALSE no value", "none, ")
fails(pulson_atlas(leaves, kernel = TRUE), "pulson_input_error", "kernel: it is no switch, and TRUE no value")
for (wrong in list("no", NA, 1, c(TRUE, FALSE)))
  fails(pulson_register(a, b, robust = wrong), "pulson_input_error", "robust: it is a switch; TRUE or FALSE is needed")
fails(pulson_warp(1, a, inverse = "no"), "pulson_input_error", "inverse: it is a switch")
fails(pulson_audit(leaves, fix = "mended.tps"), "pulson_input_error", "fix: it is a switch")
fails(pulson_write(leaves, tempfile(fileext = ".tps"), flip_y = FALSE), "pulson_input_error", "flip_y: it is no switch")
fails(pulson_register(a, b, kernal = FALSE), "pulson_input_error", "did you mean 'kernel'")
fails(pulson_register(a, b, weights = 1:19), "pulson_input_error", "weights: the name of a file")
fails(pulson_register(a, b, kernel = c("auto", "auto")), "pulson_input_error", "kernel: it takes one value")
fails(pulson_atlas(leaves, groups = c("u", "v")), "pulson_input_error", "groups: it has 2 values for 8 specimens")
known <- pulson:::verb_options("warp")
stopifnot(identical(known$inverse$takes, ""), identical(known$size$takes, "WxH"), length(known) > 40,
          identical(known[["no-flip-y"]]$takes, ""), grepl("^map from target to source", known$inverse$help))
words <- function(verb, ...) pulson:::option_words(list(...), verb)
stopifnot(words("warp", size = c(640, 480)) == "--size=640x480", words("warp", origin = c(0, 0.5)) == "--origin=0,0.5",
          words("warp", background = c(1, 2, 3)) == "--background=1,2,3",
          words("register", landmarks = c(1:3, "tip")) == "--landmarks=1,2,3,tip",
          words("register", columns = c(x = "u", y = "v")) == "--columns=x=u,y=v",
          identical(words("compare", noise = c("none", "tmb")), c("--noise=none", "--noise=tmb")),
          identical(words("register", robust = TRUE, reflect = FALSE, flip_y = FALSE), c("--robust", "--no-flip-y")))

# Messages have the arguments, values and calls of R.
in_r <- function(text, verb) pulson:::in_words_of_r(text, tempdir(), verb)
stopifnot(in_r("a; --scale apply multiplies by it", "convert") == "a; scale = \"apply\" multiplies by it",
          in_r("try --align similarity, which", "register") == "try align = \"similarity\", which",
          in_r("try --noise ch-sd:beta=100%, or more --steps.", "register") ==
            "try noise = \"ch-sd:beta=100%\", or more steps.",
          in_r("with --like or --size", "warp") == "with like or size", in_r("--dt is 0", "register") == "dt is 0",
          in_r("use --sigma 0 or --origin=0,1", "register") == "use sigma = 0 or origin = \"0,1\"")
fails(pulson_sample(list(x = a, y = b), a), "pulson_input_error", "choose one, as source[[1]]")
fails(pulson_register(system.file("extdata", "leaves.tps", package = "pulson"), a), "pulson_input_error",
      "choose one, as \"", "leaves.tps#1\"")
fails(pulson_atlas(leaves ~ factor(1:8)), "pulson_input_error", " in factor(1:8);")

# Whatever is wrong with an argument is an error of this package.
fit <- quietly(pulson_register(a, b))
atlas <- quietly(pulson_atlas(shape ~ 1, list(shape = leaves)))
stopifnot(is.null(atlas$anova))
fails(pulson_write("x.tps", leaves), "pulson_input_error", "file: the name of a file is needed")
fails(pulson_read(leaves), "pulson_input_error", "file: the name of a file is needed")
calls <- list(function(x) pulson_register(x, b), function(x) pulson_register(a, b, sigma = x, out = x),
              function(x) pulson_warp(x, a), function(x) pulson_warp(fit, x), function(x) pulson_atlas(x),
              function(x) pulson_atlas(leaves ~ x, x), function(x) pulson_mode(x), function(x) pulson_mode(atlas, x),
              function(x) pulson_mode(atlas, 1, x), function(x) pulson_audit(x), function(x) pulson_audit(leaves, fix = x),
              function(x) pulson_sample(x, b), function(x) pulson_compare(x, b), function(x) centroid_size(x),
              function(x) pulson_read(x), function(x) pulson_write(leaves, x), function(x) plot(atlas, x),
              function(x) plot(atlas, modes = x), function(x) plot(atlas, "mode", sd = x, axes = x),
              function(x) plot(fit, lines = x), function(x) plot(fit, axes = x))
grDevices::pdf(NULL)
for (call in calls) for (odd in list(list(), character(), mean, quote(x), "regression\n", data.frame(), new.env(), NULL)) {
  caught <- tryCatch(quietly(call(odd)), error = identity)
  if (inherits(caught, "error")) fails(stop(caught), "pulson_error")
}
invisible(grDevices::dev.off())

# A search that was stopped gives a result, and a warning; shapes that are not matched a warning of the program.
classes <- character()
stopped <- withCallingHandlers(suppressMessages(pulson_register(a, b, max_iterations = 1, solver = "lbfgs")),
                               warning = function(w) {
                                 classes <<- c(classes, class(w))
                                 invokeRestart("muffleWarning")
                               })
stopifnot("pulson_not_converged" %in% classes, inherits(stopped, "pulson_registration"), !stopped$converged)
words <- character()
crossed <- withCallingHandlers(suppressMessages(pulson_register(c(0, 1), c(1, 0))), warning = function(w) {
  words <<- c(words, conditionMessage(w))
  invokeRestart("muffleWarning")
})
stopifnot(any(startsWith(words, "not matched")), !crossed$matched)
notes <- character()
withCallingHandlers(pulson_atlas(leaves ~ c(NA, centroid_size(leaves)[-1]) + rep(c("a", "b"), 4), permutations = 9),
                    pulson_note = function(m) {
                      notes <<- c(notes, conditionMessage(m))
                      invokeRestart("muffleMessage")
                    })
stopifnot(any(grepl("1 specimen is left out of the model", notes)))

# Where there is no program.
options(pulson.program = "/nowhere/pulson")
fails(pulson_register(a, b), "pulson_program_error", "/nowhere/pulson", "options(pulson.program)")
stopifnot(!pulson_available())
other <- tempfile()
writeLines(c("#!/bin/sh", "echo other 1.2"), other)
Sys.chmod(other)
for (path in c(other, file.path(R.home("doc"), "COPYING"))) {
  options(pulson.program = path)
  stopifnot(!pulson_available())
  fails(pulson_version(), "pulson_program_error", "is not the program pulson", "options(pulson.program)")
  fails(pulson_register(a, b), "pulson_program_error", "is not the program pulson")
}
options(pulson.program = NULL)
stopifnot(pulson_version() >= "0.1.0")
