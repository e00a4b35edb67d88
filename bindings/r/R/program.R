# The program: where it is, how it is called, and what its exit codes become.

pulson_program <- function(required = TRUE) {
  asked <- getOption("pulson.program", Sys.getenv("PULSON"))
  found <- if (nzchar(asked)) asked else unname(Sys.which("pulson"))
  if (nzchar(found) && file.exists(found) && !dir.exists(found)) return(normalizePath(found))
  if (!required) return("")
  raise("program_error", if (nzchar(asked)) {
    paste0("there is no program '", asked, "', which ",
           if (is.null(getOption("pulson.program"))) "the environment variable PULSON" else "options(pulson.program)",
           " names")
  } else {
    paste("the program 'pulson' is not on the path; install it, or name it by",
          "options(pulson.program = \"/path/to/pulson\") or the environment variable PULSON")
  })
}

pulson_available <- function() nzchar(pulson_program(required = FALSE))

pulson_version <- function() {
  first <- system2(pulson_program(), "--version", stdout = TRUE)[1]
  numeric_version(sub("^pulson +", "", first))
}

# A condition of the classes pulson_KIND and pulson_error.
raise <- function(kind, message, ...) {
  stop(structure(class = c(paste0("pulson_", kind), "pulson_error", "error", "condition"),
                 list(message = message, call = NULL, ...)))
}

warn <- function(kind, message) {
  warning(structure(class = c(paste0("pulson_", kind), "pulson_warning", "warning", "condition"),
                    list(message = message, call = NULL)))
}

note <- function(message) {
  message(structure(class = c("pulson_note", "message", "condition"),
                    list(message = paste0("note: ", message, "\n"), call = NULL)))
}

# A number with the fewest digits that read back to the same bits.
number_text <- function(x) {
  if (!is.finite(x)) return(as.character(x))
  text <- sprintf("%.15g", x)
  if (exact_numbers(text) == x) text else sprintf("%.17g", x)
}

value_text <- function(name, value) {
  if (length(value) != 1 || is.na(value) || !(is.character(value) || is.numeric(value)))
    raise("input_error", sprintf("%s: a text, a number or TRUE is needed", name))
  if (is.numeric(value)) number_text(value) else enc2utf8(as.character(value))
}

# list(noise = "ch-sd:beta=4", no_picture = TRUE) as the words of a command line. A vector repeats its option.
option_words <- function(options) {
  names <- names(options)
  if (length(options) > 0 && (is.null(names) || any(!nzchar(names))))
    raise("input_error", paste("an argument has no name; options of the program are given by their names,",
                               "as in noise = \"ch-sd:beta=5%\""))
  taken <- intersect(names, c("out", "json", "shard", "xml", "config", "print_config", "help", "quiet", "verbose"))
  if (length(taken) > 0) raise("input_error", sprintf("%s is set by this package; leave it out", taken[1]))
  words <- character()
  for (i in seq_along(options)) {
    flag <- paste0("--", gsub("_", "-", names[i], fixed = TRUE))
    value <- options[[i]]
    if (is.null(value)) next
    if (is.factor(value)) value <- as.character(value)
    if (is.logical(value) && length(value) == 1 && !is.na(value)) {
      if (value) words <- c(words, flag)
      else if (flag == "--flip-y") words <- c(words, "--no-flip-y")
      next
    }
    if (!is.atomic(value) || length(value) == 0)
      raise("input_error", sprintf("%s: a text, a number or TRUE is needed", names[i]))
    for (each in value) words <- c(words, paste0(flag, "=", value_text(names[i], each)))
  }
  words
}

# Runs the program. Files of `folder`, which it names in messages, are what the caller knows them as.
# Returns what it printed. Exit codes: 0 done, 3 done without convergence, 2 wrong use, 1 a fault of the program.
run_program <- function(words, folder) {
  out <- file.path(folder, "printed")
  err <- file.path(folder, "messages")
  # Quotes keep an empty or odd word one word; system2 passes the rest to a shell.
  status <- system2(pulson_program(), shQuote(words), stdout = out, stderr = err, stdin = "")
  messages <- readLines(err, encoding = "UTF-8", warn = FALSE)
  messages <- in_words_of_r(messages, folder)
  unlink(err)
  if (status == 127) raise("program_error", sprintf("the program '%s' cannot be run", pulson_program()))
  is_error <- startsWith(messages, "pulson: ")
  error <- sub("^pulson: ", "", messages[is_error])
  if (!status %in% c(0, 3)) {
    kind <- if (status == 2) "input_error" else "internal_error"
    if (length(error) == 0)
      error <- c(messages, sprintf("the program ended with code %s and no message", status))
    raise(kind, paste(error, collapse = "\n"), status = status)
  }
  for (line in messages) {
    if (startsWith(line, "warning: ")) warn("warning", sub("^warning: ", "", line))
    else if (startsWith(line, "note: ")) note(sub("^note: ", "", line))
    else if (nzchar(line)) note(sub("^pulson: ", "", line))
  }
  if (status == 3) warn("not_converged", "the search did not converge; the results are those where it stopped")
  printed <- readLines(out, encoding = "UTF-8", warn = FALSE)
  unlink(out)
  in_words_of_r(printed[!startsWith(printed, "wrote ")], folder)
}

# Files of the run are called after the arguments that they hold, a command for the shell after its function, and options
# as arguments.
in_words_of_r <- function(lines, folder) {
  lines <- gsub(paste0(folder, .Platform$file.sep), "", lines, fixed = TRUE)
  lines <- gsub("\\b(source|target|shapes|points|reference|template|momenta)[.]json\\b", "\\1", lines)
  lines <- gsub("; choose one as (source|target|template)#1 or [^;]*", "; choose one, as \\1[, , 1]", lines)
  lines <- gsub("; pulson (audit|sample|register)( (source|target|shapes|reference))+$", "; see pulson_\\1()", lines)
  lines <- gsub(" [(]see pulson [a-z]+ --help[)]", "", lines)
  lines <- gsub("--no-flip-y", "flip_y = FALSE", lines, fixed = TRUE)
  options <- gregexpr("(?<![-[:alnum:]])--[a-z][a-z0-9-]*", lines, perl = TRUE)
  regmatches(lines, options) <- lapply(regmatches(lines, options), function(word) gsub("-", "_", substring(word, 3)))
  lines
}

# A folder for the files of one run. Its parts have no name that looks like a label of a shape.
run_folder <- function() {
  folder <- tempfile("pulson_")
  dir.create(folder)
  normalizePath(folder)
}

# The page and the pictures of a run take most of its time, and R draws its own.
default_options <- function(options) {
  if (is.null(options$no_picture) && is.null(options$pictures)) options$no_picture <- TRUE
  options
}
