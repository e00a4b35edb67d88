# Comparing noise models, wrong landmarks, and the posterior.

pulson_compare <- function(source, target = NULL, noise = c("none", "ch-sd:beta=fit"), ..., out = NULL) {
  options <- default_options(c(list(noise = noise), list(...)))
  work <- run_folder()
  on.exit(unlink(work, recursive = TRUE))
  folder <- result_folder(out, work)
  from <- shape_argument(source, "source", work)
  onto <- if (!is.null(target)) shape_argument(target, "target", work)
  printed <- run_program(c("compare", from$words, onto$words, paste0("--out=", folder),
                           option_words(options, "compare", if (is.null(onto)) from$shapes else onto$shapes, work)), work)
  record <- read_record(file.path(folder, "comparison.json"))
  shapes <- file.path(folder, "shapes.csv")
  # A row for each number of a model that is fitted.
  rows <- read_table(file.path(folder, "models.csv"), c("converged", "vanishes"))
  of_numbers <- c("number", "value", "low_90", "high_90", "vanishes")
  models <- rows[!duplicated(rows[setdiff(names(rows), of_numbers)]), setdiff(names(rows), of_numbers)]
  numbers <- rows[!is.na(rows$number), intersect(c("noise", of_numbers), names(rows))]
  # Of shapes in R there are names of specimens, and no files.
  by_shape <- if (file.exists(shapes)) read_table(shapes, "converged")
  if (!is.null(by_shape$specimen)) by_shape$shape <- NULL
  structure(list(models = tidy(models), numbers = tidy(numbers), shapes = by_shape, best = record$values$best,
                 verdict = in_words_of_r(Filter(nzchar, unlist(record$values$verdict)), work, "compare"),
                 record = record$values, printed = printed), class = "pulson_comparison")
}

pulson_audit <- function(shapes, reference = NULL, fix = FALSE, ..., out = NULL) {
  truth(fix, "fix")
  options <- list(...)
  options$no_picture <- if (is.null(options$no_picture)) is.null(out) else options$no_picture
  work <- run_folder()
  on.exit(unlink(work, recursive = TRUE))
  folder <- result_folder(out, work)
  judged <- shape_argument(shapes, "shapes", work)
  by <- if (!is.null(reference)) shape_argument(reference, "reference", work)
  mended <- file.path(work, "mended")
  words <- c("audit", by$words, judged$words, paste0("--out=", folder),
             option_words(options, "audit", if (is.null(by)) judged$shapes, work))
  if (fix) {
    if (is.null(judged$shapes)) raise("input_error", "fix: shapes are files; pulson_read() makes an array of one")
    # Of several files the copies are in a folder, of one it is a file.
    words <- c(words, paste0("--fix=", if (is.null(by)) paste0(mended, ".json") else paste0(mended, "/")))
  }
  printed <- run_program(words, work)
  record <- read_record(file.path(folder, "audit.json"))
  result <- list(findings = read_table(file.path(folder, "audit.csv"), "mended"), record = record$values, printed = printed)
  if (fix) {
    path <- if (is.null(by)) paste0(mended, ".json") else file.path(mended, "shapes.json")
    result$mended <- shapes
    if (file.exists(path)) {
      held <- jsonlite::fromJSON(read_record(path)$text, simplifyDataFrame = FALSE)$shapes
      result$mended <- like_input(lapply(held, function(shape) as_points(shape$points, shape$labels)), shapes,
                                  judged$shapes)
    }
  }
  structure(result, class = "pulson_audit")
}

pulson_sample <- function(source, target, ..., out = NULL) {
  options <- default_options(list(...))
  work <- run_folder()
  on.exit(unlink(work, recursive = TRUE))
  folder <- result_folder(out, work)
  from <- shape_argument(source, "source", work)
  onto <- shape_argument(target, "target", work)
  printed <- run_program(c("sample", from$words, onto$words, paste0("--out=", folder),
                           option_words(options, "sample", onto$shapes, work)), work)
  record <- read_record(file.path(folder, "summary.json"))
  array_of <- function(name) {
    path <- file.path(folder, name)
    if (file.exists(path)) read_npy(path)
  }
  parameters <- record$values$parameters
  structure(list(parameters = parameter_table(parameters), draws = read_table(file.path(folder, "draws.csv")),
                 momenta = array_of("momenta.npy"), paths = array_of("paths.npy"),
                 acceptance = record$values$acceptance, log_evidence = record$values$log_evidence,
                 record = record$values, printed = printed), class = "pulson_sample")
}

parameter_table <- function(parameters) {
  if (length(parameters) == 0) return(data.frame())
  keys <- unique(unlist(lapply(parameters, names)))
  columns <- lapply(setNames(keys, keys), function(key)
    vapply(parameters, function(one) if (is.null(one[[key]])) NA_real_ else as.numeric(one[[key]]), 0,
           USE.NAMES = FALSE))
  data.frame(parameter = names(parameters), columns, check.names = FALSE)
}

print.pulson_comparison <- function(x, ...) {
  cat(sprintf("Comparison of %d noise models by pulson; best: %s\n", nrow(x$models), short_spec(x$best)))
  shown <- intersect(c("noise", "score", "difference", "difference_error", "weight", "p_value"), names(x$models))
  table <- x$models[shown]
  table$noise <- vapply(table$noise, short_spec, "")
  print(table, digits = 5, row.names = FALSE)
  for (line in x$verdict) cat(strwrap(line, 100, initial = "verdict  ", prefix = "         "), sep = "\n")
  if (nrow(x$numbers) > 0) {
    cat("fitted\n")
    print(x$numbers, digits = 4, row.names = FALSE)
  }
  invisible(x)
}

print.pulson_audit <- function(x, ...) {
  if (nrow(x$findings) == 0) {
    cat("Audit by pulson: nothing looks wrong\n")
  } else {
    cat(sprintf("Audit by pulson: %d finding%s\n", nrow(x$findings), if (nrow(x$findings) == 1) "" else "s"))
    shown <- intersect(c("specimen", "kind", "landmarks", "log_ratio", "distance_before", "distance_after",
                         "detail"), names(x$findings))
    print(x$findings[shown], digits = 4, row.names = FALSE)
  }
  invisible(x)
}

print.pulson_sample <- function(x, ...) {
  cat(sprintf("Posterior by pulson: %d draws of %d chains\n", x$record$draws, x$record$chains))
  shown <- intersect(c("parameter", "mean", "sd", "q05", "q50", "q95", "rhat", "ess_bulk"), names(x$parameters))
  print(x$parameters[shown], digits = 4, row.names = FALSE)
  invisible(x)
}

summary.pulson_comparison <- function(object, ...) summary_of(object)
summary.pulson_audit <- function(object, ...) summary_of(object)
summary.pulson_sample <- function(object, ...) summary_of(object)
as.data.frame.pulson_comparison <- function(x, ...) x$models
as.data.frame.pulson_audit <- function(x, ...) x$findings
as.data.frame.pulson_sample <- function(x, ...) x$draws
