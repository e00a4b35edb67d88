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
options(pulson.program = NULL)
stopifnot(pulson_version() >= "0.1.0")
