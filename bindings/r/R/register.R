# One shape onto one or several others, and points that move along.

pulson_register <- function(source, target = NULL, ..., out = NULL) {
  options <- default_options(list(...))
  work <- run_folder()
  on.exit(unlink(work, recursive = TRUE))
  folder <- result_folder(out, work)
  from <- shape_argument(source, "source", work)
  onto <- if (!is.null(target)) shape_argument(target, "target", work)
  if (!is.null(options$template) && !is.character(options$template))
    options$template <- shape_argument(options$template, "template", work)$words
  printed <- run_program(c("register", from$words, onto$words, paste0("--out=", folder),
                           option_words(options, "register", if (is.null(onto)) from$shapes else onto$shapes, work)), work)
  # The rows of the source, and their names; of a file or a part of the landmarks they are those that are read.
  rows <- if (is.null(options$landmarks) && is.null(options$template)) from$shapes$points[[1]]
  if (!file.exists(file.path(folder, "cohort.json"))) {
    record <- read_record(file.path(folder, "registration.json"))
    return(registration_of(record, read_table(file.path(folder, "residuals.csv")), printed, rows))
  }
  record <- read_record(file.path(folder, "cohort.json"))
  specimens <- read_table(file.path(folder, "cohort.csv"), c("converged", "matched"))
  registrations <- lapply(setNames(specimens$folder, specimens$specimen), function(name) {
    at <- file.path(folder, name)
    if (is.na(name) || !file.exists(file.path(at, "registration.json"))) return(NULL)  # of a shape that failed
    registration_of(read_record(file.path(at, "registration.json")), read_table(file.path(at, "residuals.csv")), "", rows)
  })
  structure(list(specimens = specimens[setdiff(names(specimens), "folder")], registrations = registrations,
                 record = record$values, printed = printed), class = "pulson_cohort")
}

# Where results stay: the user's folder, or one that goes with the call.
result_folder <- function(out, work) {
  if (is.null(out)) return(file.path(work, "results"))
  one_file(out, "out", "folder")
  file.path(normalizePath(dirname(out), mustWork = FALSE), basename(out))
}

# @param rows the source as it was given: landmarks that are left out of the match are NA in the results
registration_of <- function(record, residuals, printed, rows = NULL) {
  values <- record$values
  labels <- values$source_shape$labels
  numbers <- values$source_shape$numbers
  points <- function(value) {
    held <- as_points(value, labels)
    if (is.null(rows) || length(numbers) != nrow(held) || nrow(held) == nrow(rows) || !all(numbers %in% seq_len(nrow(rows))))
      return(held)
    all <- matrix(NA_real_, nrow(rows), ncol(held), dimnames = list(rownames(rows), colnames(held)))
    all[numbers, ] <- held
    all
  }
  if (nrow(residuals) > 0 && !anyDuplicated(residuals$landmark)) rownames(residuals) <- residuals$landmark
  structure(list(source = points(values$original), target = points(values$target), aligned = points(values$source),
                 result = points(values$result), momenta = points(values$momenta), landmarks = residuals,
                 rms = values$rms, max_residual = values$max_residual, cost = unlist(values$cost), kernel = values$kernel,
                 noise = values$noise, mode = values$mode, sigma = values$sigma, lambda = values$lambda,
                 converged = values$converged, matched = values$matched, record = values, text = record$text,
                 printed = printed), class = "pulson_registration")
}

as_registration <- function(x) {
  if (inherits(x, "pulson_registration")) return(x)
  raise("input_error", paste0("registration: what pulson_register() returns is needed, and it is of the class ",
                              class(x)[1], if (inherits(x, "pulson_cohort"))
                                "; take one of its $registrations" else ""))
}

pulson_warp <- function(registration, points, inverse = FALSE, out = NULL, ...) {
  options <- c(list(...), inverse = truth(inverse, "inverse"))
  work <- run_folder()
  on.exit(unlink(work, recursive = TRUE))
  record <- file.path(work, "registration.json")
  writeBin(charToRaw(as_registration(registration)$text), record)
  words <- c("warp", record)
  if (is.character(points)) {
    if (is.null(out)) raise("input_error", "out: the file of the warped image or points is needed")
    one_file(out, "out")
    at <- file.path(normalizePath(dirname(out), mustWork = FALSE), basename(out))
    printed <- run_program(c(words, shape_argument(points, "points", work)$words, paste0("--out=", at),
                             option_words(options, "warp")), work)
    return(invisible(structure(out, printed = printed)))
  }
  if (!is.null(out)) raise("input_error", "out: it is for files of points or images; points in R are returned")
  shapes <- as_shapes(points, "points")
  input <- write_shapes(shapes, file.path(work, "points.json"))
  moved <- file.path(work, "moved.json")
  run_program(c(words, input, paste0("--out=", moved), option_words(options, "warp")), work)
  held <- jsonlite::fromJSON(read_record(moved)$text, simplifyDataFrame = FALSE)$shapes
  like_input(lapply(held, function(shape) as_points(shape$points, shape$labels)), points, shapes)
}

print.pulson_registration <- function(x, ...) {
  cat(sprintf("Registration of %d landmarks in %dD by pulson\n", sum(!is.na(x$source[, 1])), ncol(x$source)))
  left_out <- sum(is.na(x$source[, 1]))
  if (left_out > 0) cat(sprintf("left out %d landmark%s, NA in the results\n", left_out, if (left_out == 1) "" else "s"))
  cat(sprintf("rms      %.4g before, %.4g after: %s\n", x$record$initial_rms, x$rms,
              if (isTRUE(x$matched)) "matched" else "NOT MATCHED"))
  cat(sprintf("cost     %.4g = energy %.4g + action %.4g + data %.4g\n", x$cost[["total"]], x$cost[["energy"]],
              x$cost[["action"]], x$cost[["data"]]))
  cat(sprintf("model    kernel %s, noise %s, sigma %.4g, lambda %.4g\n", short_spec(x$kernel), short_spec(x$noise),
              x$sigma, x$lambda))
  if (!isTRUE(x$converged)) cat("NOT CONVERGED\n")
  invisible(x)
}

# The numbers of a specification with four digits.
short_spec <- function(spec) {
  at <- gregexpr("[0-9]+[.][0-9]{4,}(e[-+]?[0-9]+)?", spec)
  regmatches(spec, at) <- lapply(regmatches(spec, at), function(x) format(as.numeric(x), digits = 4, trim = TRUE))
  spec
}

print.pulson_cohort <- function(x, ...) {
  cat(sprintf("Registrations of %d shapes by pulson\n", nrow(x$specimens)))
  shown <- intersect(c("specimen", "rms", "energy", "action", "total", "converged", "centroid_size"),
                     names(x$specimens))
  print(utils::head(x$specimens[shown], 10), digits = 4, row.names = FALSE)
  if (nrow(x$specimens) > 10) cat(sprintf("and %d more\n", nrow(x$specimens) - 10))
  invisible(x)
}

as.data.frame.pulson_registration <- function(x, ...) x$landmarks
as.data.frame.pulson_cohort <- function(x, ...) x$specimens

# What the program prints of a run.
summary_of <- function(object) structure(list(printed = object$printed, of = class(object)[1]), class = "summary.pulson")

print.summary.pulson <- function(x, ...) {
  cat(x$printed, sep = "\n")
  invisible(x)
}

summary.pulson_registration <- function(object, ...) summary_of(object)
summary.pulson_cohort <- function(object, ...) summary_of(object)
